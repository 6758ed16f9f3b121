"""Poses of objects in the script's process, valid while only the script's own marks are moved.

The API's own functions compute with these poses, so results are identical to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.objects import Objects

Place = tuple[int, Matrix, Matrix | None, int, bool]  # see `place_of`


def place_of(objects: ObjectTree, handle: Any) -> Place | None:
    """Return an object's Place, in the simulation's process; None if there is no such object.

    A Place is: its handle; the transform from its frame to the world; the same for its children's frame (None: equal);
    the handle of its root object; whether it is a mark. A mark is a dummy without a parent that a script moves for its
    own use, such as V-REP's track frame.
    """
    item = objects.get(handle)
    if item is None:
        return None
    root = item
    while root.parent is not None:
        root = root.parent
    matrix, child_frame = item.matrix(), item.below()
    is_mark = root is item and item.kind == "dummy" and item.body is None and type(item).put is SceneObject.put
    return handle, matrix, None if child_frame is matrix else child_frame, objects.handle_of(root), is_mark


class _Frame(SceneObject):
    """An object at a pose received from the simulation's process."""

    def __init__(self) -> None:
        super().__init__(("",), "", None)
        self.is_mark, self.root = False, WORLD
        self.under: Matrix | None = None

    def below(self) -> Matrix:
        return self.local if self.under is None else self.under


class Places:
    """The poses known in the current phase."""

    def __init__(self) -> None:
        self._frames: dict[int, _Frame] = {}  # of this and earlier phases
        self._known: dict[int, _Frame] = {}
        self._tree = ObjectTree()
        self._functions = Objects.__new__(Objects)
        self._functions._objects = self._tree

    def function(self, name: str) -> Callable[..., Any]:
        """Return a function of the API that uses these poses."""
        function: Callable[..., Any] = getattr(self._functions, name)
        return function

    def take(self, places: Iterable[Place]) -> None:
        known: dict[int, _Frame] = {}
        for handle, matrix, under, root, is_mark in places:
            frame = self._frames.get(handle)
            if frame is None:
                frame = self._frames[handle] = _Frame()
            frame.local, frame.under, frame.root, frame.is_mark = matrix, under, root, is_mark
            known[handle] = frame
        self._known = self._tree._objects = known  # type: ignore[assignment]

    def knows(self, handle: Any, frame: Any) -> bool:
        """Return whether the pose of an object relative to another object, or to the world, is known."""
        return handle in self._known and (frame == WORLD or frame in self._known)

    def is_mark(self, handle: Any) -> bool:
        frame = self._known.get(handle)
        return frame is not None and frame.is_mark

    def forget_below(self, mark: int) -> None:
        """Discard the poses of a mark's descendants."""
        for handle in [key for key, frame in self._known.items() if frame.root == mark and key != mark]:
            del self._known[handle]

    def is_apart(self, handle: int, mark: int) -> bool:
        """Return whether an object is known, and is neither this mark nor a descendant of it."""
        frame = self._known.get(handle)
        return frame is not None and frame.root != mark
