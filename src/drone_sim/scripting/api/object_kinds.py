"""`sim`: what objects are, and how they hang together."""

from __future__ import annotations

from collections.abc import Iterator

from drone_sim.mechanics.object_tree import SceneObject
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.handles import bare
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.types import Handle

_ALL, _SCENE = CONSTANTS["handle_all"], CONSTANTS["handle_scene"]
_WITHOUT_ROOT, _CHILDREN_ALONE = 1, 2  # options of getObjectsInTree
_KINDS = {"joint": "joint", "base": "dummy"}  # of the parts of a quadricopter, by the end of their names


class ObjectKinds:
    """The functions on kinds of objects and on the tree."""

    def __init__(self, host: Host, surroundings: Surroundings):
        """Take the drone whose objects they are, and its cameras."""
        self._objects = host.objects
        self._sensors = host.sensors
        self._pictures = surroundings.pictures

    def getObjectType(self, handle: Handle) -> int:
        """Return what an object is: sim.object_shape_type (4.x: sim.sceneobject_shape), _joint_type and so on."""
        return self._kind(self._objects[handle])

    def getObjects(self, index: int, kind: int = _ALL) -> int:
        """Return the handle of the index-th object of a kind, from 0; -1 where there are no more."""
        found = self._of_kind(iter(self._objects), kind)
        return found[int(index)] if 0 <= index < len(found) else -1

    def getObjectsInTree(self, root: Handle, kind: int = _ALL, options: int = 0) -> list[int]:
        """Return the objects of a kind below another (sim.handle_scene: all), itself first.

        `options`: 1 leaves out the root, 2 takes its children alone.
        """
        of_scene = root in (_SCENE, -1)
        above = None if of_scene else self._objects[root]
        below = list(self._below(above, deep=not int(options) & _CHILDREN_ALONE))
        if not of_scene and not int(options) & _WITHOUT_ROOT:
            below.insert(0, int(root))
        return self._of_kind(iter(below), kind)

    def getObjectChild(self, handle: Handle, index: int) -> int:
        """Return the handle of an object's index-th child, from 0; -1 where there are no more."""
        children = [child for child, _ in self._objects.children(self._objects[handle])]
        return children[int(index)] if 0 <= index < len(children) else -1

    def isHandle(self, handle: Handle, _kind: int = -1) -> bool:
        """Return whether an object has that handle (4.x)."""
        return bare(handle) in set(self._objects)

    def isHandleValid(self, handle: Handle, _kind: int = -1) -> int:
        """Return 1 where an object has that handle, else 0 (3.x)."""
        return int(self.isHandle(handle))

    def getObjectUid(self, handle: Handle) -> int:
        """Return a number that no other object of the run has had: its handle."""
        self._objects[handle]
        return int(handle)

    getObjectUniqueIdentifier = getObjectUid

    def _below(self, above: SceneObject | None, deep: bool) -> Iterator[int]:
        for handle, child in self._objects.children(above):
            yield handle
            if deep:
                yield from self._below(child, deep)

    def _of_kind(self, handles: Iterator[int], kind: int) -> list[int]:
        return [handle for handle in handles if kind == _ALL or self._kind(self._objects[handle]) == kind]

    def _kind(self, found: SceneObject) -> int:
        """Return the kind of an object: a sensor's, that of a quadricopter's part, else a shape's."""
        name = found.name
        if name in self._pictures:
            kind = "visionsensor"
        elif name in self._sensors:
            kind = "proximitysensor" if hasattr(self._sensors[name], "detected") else "dummy"
        else:
            kind = getattr(found, "kind", "") or _KINDS.get(found.alias.lower(), "shape")
        return CONSTANTS[f"object_{kind.replace('_', '')}_type"]
