"""How far objects are from each other: what sim.checkDistance and sim.checkCollision measure."""

from __future__ import annotations

import math

from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import ShapeObject
from drone_sim.scripting.api.distances import Nearest
from drone_sim.world.queries import Gap

_BASE = "Quadricopter_base"
_Solid = tuple[int, int]  # a body in the world and its link, -1 the root


class Distances:
    """Measures between solids. A vehicle is one; an object that is no shape, such as a dummy, is a point."""

    def __init__(self, context: SimulationContext):
        """Take what the simulation shares."""
        self._context = context

    def nearest(self, one: SceneObject, other: SceneObject | None, reach: float) -> Nearest | None:
        """Return the shortest way within `reach` (m) from an object to another, or to any (None).

        Raises ValueError for two that are parts of the same solid, and for a point without another object.
        """
        self._context.carried.follow()
        solid, another = self._solid(one), self._solid(other)
        if other is not None and (one is other or (solid is not None and solid == another)):
            raise ValueError(f"'{one.name}' and '{other.name}' are parts of one rigid body")
        if solid is None:
            return self._from_point(one, other, another, reach)
        if other is not None and another is None:
            back = self._to_solid(frames.position(other.matrix()), solid, reach)
            return back and Nearest(back.distance, back.end, back.start, one.name)
        return self._between(solid, another, reach)

    def _from_point(
        self, one: SceneObject, other: SceneObject | None, solid: _Solid | None, reach: float
    ) -> Nearest | None:
        start = frames.position(one.matrix())
        if other is None:
            raise ValueError(f"'{one.name}' is a point: it is measured to one object, not to all")
        if solid is not None:
            return self._to_solid(start, solid, reach, other.name)
        end = frames.position(other.matrix())
        distance = math.dist(start, end)
        return Nearest(distance, start, end, other.name) if distance <= reach else None

    def _to_solid(self, point: Vector, solid: _Solid, reach: float, name: str = "") -> Nearest | None:
        """Return the shortest way from a point to a solid."""
        queries = self._context.world.queries
        met = queries.nearest_points(point, reach, lambda *place: place == solid, measured=True)
        ways = [Nearest(math.dist(point, one.point), point, one.point, name) for one in met]
        return min(ways, default=None)

    def _between(self, solid: _Solid, other: _Solid | None, reach: float) -> Nearest | None:
        queries = self._context.world.queries
        gaps = queries.gaps(*solid, reach, lambda *place: place == other if other else place[0] != solid[0])
        best: Gap | None = min(gaps, key=lambda gap: gap.distance, default=None)
        if best is None:
            return None
        name = self._context.name_of(best.body, best.link)
        return Nearest(max(0.0, best.distance), best.own_point, best.point, name)

    def _solid(self, one: SceneObject | None) -> _Solid | None:
        """Return what an object is in the world, or what carries it where it is a shape of a vehicle; None for none."""
        if one is None:
            return None
        if isinstance(one, ShapeObject):
            return one.number, one.link
        if one.name == "Floor":
            return self._context.body_of("Floor"), -1
        number = getattr(_carrier(one).body, "number", None)
        return None if number is None else (number, -1)


def _carrier(one: SceneObject) -> SceneObject:
    """Return the body of which an object without one is a part: of its vehicle's, a propeller and the base are."""
    above = one.parent
    if one.body is not None or above is None:
        return one
    is_part = above.kind == "force_sensor" or plain(one.name) == _BASE
    return _carrier(above) if is_part or one.kind == "force_sensor" else one
