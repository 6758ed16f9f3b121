"""`sim`: distances and collisions between objects, measured when they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import Handle, Number, numbers

_ALL = CONSTANTS["handle_all"]
_FAR = 1e5  # m, where no threshold is given


class Nearest(NamedTuple):
    """The shortest way from one object to another: m, 0 where they overlap; its ends, world frame; the other's name."""

    distance: float
    start: Vector
    end: Vector
    name: str  # '' where scripts know none


# Returns the shortest way within so many m from an object to another, or to any (None). Raises ValueError.
MeasureWay = Callable[[SceneObject, SceneObject | None, float], Nearest | None]


class DistanceFunctions:
    """Distances and collisions between objects, measured when they are asked for."""

    def __init__(self, objects: ObjectTree, nearest: MeasureWay):
        """`nearest` measures between the `objects`."""
        self._objects = objects
        self._nearest = nearest

    @sim("345")
    def checkDistance(
        self, entity1: Handle, entity2: Handle = _ALL, threshold: Number = 0.0
    ) -> tuple[int, list[float], list[int]]:
        """Return whether two objects are nearer than a threshold (m, 0 is none), the shortest way, and their handles.

        The way has 7 numbers: both ends (m, world), and its length, 0 where they overlap. The second object may be
        sim.handle_all. A vehicle is one solid; dummies, sensors and targets are points. Between two meshes that are not
        convex no way is found.
        """
        (limit,) = numbers((threshold,), 1)
        way = self._way(entity1, entity2, limit if 0 < limit < _FAR else _FAR)
        if way is None:
            return 0, [0.0] * 7, [WORLD, WORLD]
        return 1, [*way.start, *way.end, way.distance], self._pair(entity1, entity2, way)

    @sim("")
    def checkCollision(self, entity1: Handle, entity2: Handle = _ALL) -> tuple[int, list[int]]:
        """Return whether two objects overlap (1, or 0), and their handles. The second may be sim.handle_all.

        What touches, respondable or not, overlaps; so does, unlike in V-REP, what is wholly inside. Points do not.
        """
        way = self._way(entity1, entity2, 0.0)
        if way is None or way.distance > 0:
            return 0, [WORLD, WORLD]
        return 1, self._pair(entity1, entity2, way)

    def _way(self, entity1: int, entity2: int, reach: float) -> Nearest | None:
        other = None if entity2 == _ALL else self._objects[entity2]
        return self._nearest(self._objects[entity1], other, reach)

    def _pair(self, entity1: int, entity2: int, way: Nearest) -> list[int]:
        if entity2 != _ALL:
            return [entity1, entity2]
        return [entity1, self._objects.handle(way.name) if way.name in self._objects else WORLD]
