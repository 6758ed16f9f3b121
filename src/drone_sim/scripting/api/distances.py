"""`sim`: distances and collisions between objects, measured when they are asked for."""

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
_FAR = 1e5  # m, where no threshold is given


class Nearest(NamedTuple):
    """The shortest way from one object to another: m, 0 where they overlap; its ends, world frame; both names."""

    distance: float
    start: Vector
    end: Vector
    own: str
    name: str  # '' where scripts know none


# Returns the shortest way within so many m from some objects to others, or to any (None). Raises ValueError.
MeasureWay = Callable[[Sequence[SceneObject], Sequence[SceneObject] | None, float], Nearest | None]


class DistanceFunctions:
    """Distances and collisions between objects."""

    def __init__(self, objects: ObjectTree, collections: Collections, nearest: MeasureWay):
        """`nearest` measures between the `objects`, of which there may be `collections`."""
        self._objects = objects
        self._collections = collections
        self._nearest = nearest

    @sim("345")
    def checkDistance(
        self, entity1: Handle, entity2: Handle = _ALL, threshold: Number = 0.0
    ) -> tuple[int, list[float], list[int]]:
        """Return whether two entities are nearer than a threshold (m; 0: none), the shortest line, and the objects.

        Each is an object or a collection, the second may be sim.handle_all. The way has 7 numbers: both ends (m,
        world), and its length, 0 where they overlap. A vehicle is one solid; dummies, sensors and targets are points,
        of a collection the shapes and dummies alone count. Between two meshes that are not convex no way is found.
        """
        (limit,) = numbers((threshold,), 1)
        way = self._way(entity1, entity2, limit if 0 < limit < _FAR else _FAR, ("shape", "dummy"))
        if way is None:
            return 0, [0.0] * 7, [WORLD, WORLD]
        return 1, [*way.start, *way.end, way.distance], self._pair(way)

    @sim("")
    def checkCollision(self, entity1: Handle, entity2: Handle = _ALL) -> tuple[int, list[int]]:
        """Return 1 if two objects or collections overlap, otherwise 0, and the handles of these objects.

        The second entity may be sim.handle_all.

        What touches, respondable or not, overlaps; so does, unlike in V-REP, what is wholly inside. Points do not.
        """
        way = self._way(entity1, entity2, 0.0, ("shape",))
        if way is None or way.distance > 0:
            return 0, [WORLD, WORLD]
        return 1, self._pair(way)

    def _way(self, entity1: int, entity2: int, reach: float, kinds: Collection[str]) -> Nearest | None:
        others = None if entity2 == _ALL else self._entity(entity2, kinds)
        return self._nearest(self._entity(entity1, kinds), others, reach)

    def _entity(self, handle: int, kinds: Collection[str]) -> list[SceneObject]:
        """Return an object, or those of a collection that are of some kinds."""
        found = [self._objects[one] for one in members(handle, self._objects, self._collections)]
        return [one for one in found if one.kind in kinds] if handle in self._collections else found

    def _pair(self, way: Nearest) -> list[int]:
        return [self._objects.handle(name) if name in self._objects else WORLD for name in (way.own, way.name)]
