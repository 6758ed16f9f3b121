"""Places of objects in the script's process, valid as long as only the script's own marks have moved.

The functions on places are those of the API itself: the same numbers come out, to the last bit.
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
    """Return, in the simulation's process, where an object is; None if there is no such object.

    That is its handle; the transform from its frame to the world; that from its children's frame, None if it is the
    same; the handle of its root object; and whether it is a mark: a dummy without a parent, which a script moves for
    its own use, such as V-REP's track frame.
    """
    one = objects.get(handle)
    if one is None:
        return None
    root = one
    while root.parent is not None:
        root = root.parent
    matrix, below = one.matrix(), one.below()
    is_mark = root is one and one.kind == "dummy" and one.body is None and type(one).put is SceneObject.put
    return handle, matrix, None if below is matrix else below, objects.handle_of(root), is_mark


class _Frame(SceneObject):
    """An object at the place that the simulation's process has sent."""

    def __init__(self) -> None:
        super().__init__(("",), "", None)
        self.is_mark, self.root = False, WORLD
        self.under: Matrix | None = None

    def below(self) -> Matrix:
        return self.local if self.under is None else self.under


class _Tree(ObjectTree):
    """The objects whose places are known."""

    def __init__(self) -> None:
        super().__init__()
        self.known: dict[int, _Frame] = {}

    def take(self, known: dict[int, _Frame]) -> None:
        self.known = known
        self._objects = known  # type: ignore[assignment]


class Places:
    """The objects whose places are known in the phase that runs."""

    def __init__(self) -> None:
        """Know none."""
        self._frames: dict[int, _Frame] = {}
        self._tree = _Tree()
        self._objects = Objects.__new__(Objects)
        self._objects._objects = self._tree

    def function(self, name: str) -> Callable[..., Any]:
        """Return a function of the API that acts on these places."""
        found: Callable[..., Any] = getattr(self._objects, name)
        return found

    def take(self, places: Iterable[Place]) -> None:
        """Know these, and no others."""
        known: dict[int, _Frame] = {}
        for handle, matrix, under, root, is_mark in places:
            frame = self._frames.get(handle)
            if frame is None:
                frame = self._frames[handle] = _Frame()
            frame.local, frame.under, frame.root, frame.is_mark = matrix, under, root, is_mark
            known[handle] = frame
        self._tree.take(known)

    def knows(self, handle: Any, frame: Any) -> bool:
        """Tell whether one object's place relative to another, or to the world, is known."""
        known = self._tree.known
        return handle in known and (frame == WORLD or frame in known)

    def is_mark(self, handle: Any) -> bool:
        """Tell whether an object is known, and a mark."""
        frame = self._tree.known.get(handle)
        return frame is not None and frame.is_mark

    def forget_below(self, mark: int) -> None:
        """Forget the places of the objects that hang on a mark."""
        known = self._tree.known
        for handle in [one for one, frame in known.items() if frame.root == mark and one != mark]:
            del known[handle]

    def is_apart(self, handle: int, mark: int) -> bool:
        """Tell whether an object is known, and is neither this mark nor hangs on it."""
        frame = self._tree.known.get(handle)
        return frame is not None and frame.root != mark
