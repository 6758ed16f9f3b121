"""Mirror of the simulation's state in the script's process: the results of reads, and poses of objects.

Poses, so that a mark can be moved without a message. A mark is a dummy without a parent, such as V-REP's track frame: a
controller moves it in every step, and reads its vehicle's pose relative to it. Without this, a step of the built-in
script would take three messages to the script instead of two. The API's own functions compute with the poses, so
results are equal to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.calls import Function
from drone_sim.scripting.api.constants import bare
from drone_sim.scripting.rpc.effects import POSES, READS

POSE = "pose"  # the name of the read whose result is `pose_of` an object
_MARK = 12  # index in a pose
Read = tuple[str, tuple[Any, ...]]  # a function's name and its arguments


def pose_of(objects: ObjectTree, handle: int) -> list[Any]:
    """Return an object's transform (12 numbers, world), and the handle of the mark that it moves with, or WORLD.

    Called in the simulation's process. Raises ValueError for an unknown object, and for a joint that is turned, because
    its children are relative to another frame.
    """
    item = root = objects[handle]
    while root.parent is not None:
        root = root.parent
    matrix = item.matrix()
    if item.below() != matrix:
        raise ValueError("a joint that is turned")
    is_mark = root.kind == "dummy" and root.body is None and type(root).put is SceneObject.put
    return [*matrix, objects.handle_of(root) if is_mark else WORLD]


class Mirror:
    """The results and poses that are valid now."""

    def __init__(self) -> None:
        self.results: dict[Read, Any] = {}
        self.objects = ObjectTree()  # those in `_poses`, and earlier ones, whose poses are no longer valid
        self._poses: dict[int, list[Any]] = {}  # by handle

    def take(self, reads: Iterable[Read], results: Iterable[Any]) -> None:
        """Replace everything by the results of reads; Ellipsis means that a read failed."""
        self.results, self._poses = {}, {}
        for read, result in zip(reads, results):
            if result is Ellipsis:
                continue
            if read[0] != POSE:
                self.results[read] = result
                continue
            (handle,) = read[1]
            self._poses[handle] = result
            item = self.objects.by_handle.get(handle)
            if item is None:
                item = SceneObject((str(handle),), "", None)
                self.objects.reserve({item.name: handle})
                self.objects.insert(item)
            item.local = tuple(result[:_MARK])

    def knows(self, handle: int, frame: int) -> bool:
        """Return whether the pose of an object relative to another one, or to the WORLD, is known."""
        return handle in self._poses and (frame in self._poses or frame == WORLD)

    def forget(self, kind: str) -> None:
        """Remove all results of a kind."""
        if kind == POSES:
            self._poses = {}
        self.results = {read: result for read, result in self.results.items() if READS[read[0]] != kind}

    def move_mark(self, function: Function, arguments: tuple[Any, ...]) -> bool:
        """Move a mark by a function of the API, and remove what depends on its pose.

        Return False, and do nothing, if the object is not a known mark, or a pose among the arguments is unknown.
        """
        mark = arguments[0]
        for argument in arguments:
            if type(argument) is not list and not self.knows(mark, argument):
                return False
        if self._poses[mark][_MARK] != mark:
            return False
        try:
            function(*arguments)
        except Exception:  # raised again in the simulation
            return False
        self._poses = {key: pose for key, pose in self._poses.items() if pose[_MARK] != mark or key == mark}
        for read in [read for read in self.results if READS[read[0]] == POSES]:
            pose = self._poses.get(bare(read[1][0]))
            if pose is None or pose[_MARK] == mark:
                del self.results[read]
        return True
