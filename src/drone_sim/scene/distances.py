"""How far objects are from each other: what sim.checkDistance and sim.checkCollision measure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import ShapeObject
from drone_sim.scripting.api.distances import Nearest
from drone_sim.world.queries import Gap

_PARTS = ("Quadricopter_base", "Quadricopter_propeller")  # of a vehicle's body
_Solid = tuple[int, int]  # a body in the world and its link, -1 the root


class _Sorted(NamedTuple):
    """Objects: the solids that they are or that carry them, each with the first one's name; and those without one."""

    solids: dict[_Solid, str]
    points: list[SceneObject]


class Distances:
    """Measures between solids. A vehicle is one; an object that is no shape, such as a dummy, is a point."""

    def __init__(self, context: SimulationContext):
        """Take what the simulation shares."""
        self._context = context

    def nearest(
        self, ones: Sequence[SceneObject], others: Sequence[SceneObject] | None, reach: float
    ) -> Nearest | None:
        """Return the shortest way within `reach` (m) from some objects to others, or to any but these (None).

        Raises ValueError for two that are parts of the same solid, and for a point without another object.
        """
        self._context.carried.follow()
        own = self._sorted(ones)
        if others is None:
            if own.points and len(ones) == 1:
                raise ValueError(
                    f"'{ones[0].name}' is a point: its distance can be measured to one object, but not to all objects"
                )
            bodies = {body for body, _ in own.solids}
            ways = self._between(own, lambda *place: place[0] not in bodies, {}, reach)
            return min(ways, default=None)
        other = self._sorted(others)
        if len(ones) == len(others) == 1 and (ones[0] is others[0] or own.solids.keys() & other.solids.keys()):
            raise ValueError(f"'{ones[0].name}' and '{others[0].name}' are parts of one rigid body")
        ways = itertools.chain(
            self._between(own, lambda *place: place in other.solids, other.solids, reach),
            self._to_solids(own.points, other.solids, reach),
            map(_turned, self._to_solids(other.points, own.solids, reach)),
            _between_points(own.points, other.points, reach),
        )
        return min(ways, default=None)

    def _sorted(self, objects: Sequence[SceneObject]) -> _Sorted:
        found = _Sorted({}, [])
        for one in objects:
            solid = self._solid(one)
            if solid is None:
                found.points.append(one)
            else:
                found.solids.setdefault(solid, one.name)
        return found

    def _to_solids(
        self, points: Sequence[SceneObject], solids: Mapping[_Solid, str], reach: float
    ) -> Iterator[Nearest]:
        """Yield the shortest ways from points to solids."""
        for one in points if solids else ():
            start = frames.position(one.matrix())
            queries = self._context.world.queries
            for met in queries.nearest_points(start, reach, lambda *place: place in solids, measured=True):
                name = solids[met.body, met.link]
                yield Nearest(math.dist(start, met.point), start, met.point, one.name, name)

    def _between(
        self, own: _Sorted, counts: Callable[[int, int], bool], names: Mapping[_Solid, str], reach: float
    ) -> Iterator[Nearest]:
        """Yield ways from solids to others that count."""
        for solid, name in own.solids.items():
            gaps = self._context.world.queries.gaps(*solid, reach, counts)
            best: Gap | None = min(gaps, key=lambda gap: gap.distance, default=None)
            if best is not None:
                met = names.get((best.body, best.link)) or self._context.name_of(best.body, best.link)
                yield Nearest(max(0.0, best.distance), best.own_point, best.point, name, met)

    def _solid(self, one: SceneObject) -> _Solid | None:
        """Return what an object is in the world, or what carries it where it is a shape of a vehicle; None for none."""
        if isinstance(one, ShapeObject):
            return one.number, one.link
        if one.name == "Floor":
            return self._context.body_of("Floor"), -1
        number = getattr(_carrier(one).body, "number", None)
        return None if number is None else (number, -1)


def _turned(way: Nearest) -> Nearest:
    return Nearest(way.distance, way.end, way.start, way.name, way.own)


def _between_points(ones: Sequence[SceneObject], others: Sequence[SceneObject], reach: float) -> Iterator[Nearest]:
    for one, other in itertools.product(ones, others):
        start, end = frames.position(one.matrix()), frames.position(other.matrix())
        distance = math.dist(start, end)
        if one is not other and distance <= reach:
            yield Nearest(distance, start, end, one.name, other.name)


def _carrier(one: SceneObject) -> SceneObject:
    """Return the body of which an object without one is a part: of its vehicle's, a propeller and the base are."""
    above = one.parent
    if one.body is not None or above is None:
        return one
    is_part = plain(one.name).startswith(_PARTS)
    return _carrier(above) if is_part or "force_sensor" in (one.kind, above.kind) else one
