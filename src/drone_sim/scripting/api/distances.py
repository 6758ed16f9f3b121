"""`sim`: distances and collisions between objects, measured when a script calls the functions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_collections import Collections, members
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import Handle, Number, numbers

_ALL = CONSTANTS["handle_all"]
_FAR = 1e5  # m, without a threshold


class Nearest(NamedTuple):
    """The shortest line between two objects: length (m, 0 if they overlap), ends (world frame), and both names."""

    distance: float
    start: Vector
    end: Vector
    own: str
    name: str  # '' if it has none for scripts


# Returns the shortest line, up to a length in m, from some objects to others, or to any object (None). Raises
# ValueError.
MeasureDistance = Callable[[Sequence[SceneObject], Sequence[SceneObject] | None, float], Nearest | None]


class DistanceFunctions:
    """Distances and collisions between objects."""

    def __init__(self, objects: ObjectTree, collections: Collections, nearest: MeasureDistance):
        """`nearest` measures distances between `objects`; `collections` consist of them."""
        self._objects = objects
        self._collections = collections
        self._nearest = nearest

    @sim("345")
    def checkDistance(
        self, entity1: Handle, entity2: Handle = _ALL, threshold: Number = 0.0
    ) -> tuple[int, list[float], list[int]]:
        """Return whether two entities are closer than a threshold (m; 0: none), the shortest line, and the objects.

        Each entity is an object or a collection; the second may be sim.handle_all. The line has 7 numbers: both ends
        (m, world), and its length, which is 0 if they overlap. A vehicle is a single solid; dummies, sensors and
        targets are points. In a collection, only shapes and dummies count. Between two meshes that are not convex, no
        line is found.
        """
        (limit,) = numbers((threshold,), 1)
        line = self._shortest_line(entity1, entity2, limit if 0 < limit < _FAR else _FAR, ("shape", "dummy"))
        if line is None:
            return 0, [0.0] * 7, [WORLD, WORLD]
        return 1, [*line.start, *line.end, line.distance], self._handles(line)

    @sim("")
    def checkCollision(self, entity1: Handle, entity2: Handle = _ALL) -> tuple[int, list[int]]:
        """Return 1 if two objects or collections overlap, otherwise 0, and the handles of these objects.

        The second entity may be sim.handle_all.

        Objects that touch overlap, respondable or not. Unlike in V-REP, an object inside another overlaps. Points do
        not.
        """
        line = self._shortest_line(entity1, entity2, 0.0, ("shape",))
        if line is None or line.distance > 0:
            return 0, [WORLD, WORLD]
        return 1, self._handles(line)

    def _shortest_line(self, entity1: int, entity2: int, limit: float, kinds: Collection[str]) -> Nearest | None:
        others = None if entity2 == _ALL else self._entity(entity2, kinds)
        return self._nearest(self._entity(entity1, kinds), others, limit)

    def _entity(self, handle: int, kinds: Collection[str]) -> list[SceneObject]:
        """Return an object, or the objects of some kinds in a collection."""
        found = [self._objects[member] for member in members(handle, self._objects, self._collections)]
        return [item for item in found if item.kind in kinds] if handle in self._collections else found

    def _handles(self, line: Nearest) -> list[int]:
        return [self._objects.handle(name) if name in self._objects else WORLD for name in (line.own, line.name)]
