"""Distances between objects, for sim.checkDistance and sim.checkCollision."""

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

_PARTS = ("Quadricopter_base", "Quadricopter_propeller")  # objects that are parts of a vehicle's body
_Solid = tuple[int, int]  # body in the world, and its link (-1: the root)


class _Sorted(NamedTuple):
    """Objects split into solids, with the name of the first object of each, and points: objects without a solid."""

    solids: dict[_Solid, str]
    points: list[SceneObject]


class Distances:
    """Measures distances. A vehicle is a solid; an object that is not a shape, such as a dummy, is a point."""

    def __init__(self, context: SimulationContext):
        self._context = context

    def nearest(
        self, ones: Sequence[SceneObject], others: Sequence[SceneObject] | None, reach: float
    ) -> Nearest | None:
        """Return the nearest pair within `reach` (m) between `ones` and `others` (None: all other objects).

        Raises ValueError for two parts of the same solid, and for a single point without `others`.
        """
        self._context.carried.follow()
        first = self._split(ones)
        if others is None:
            if first.points and len(ones) == 1:
                raise ValueError(
                    f"'{ones[0].name}' is a point: its distance can be measured to one object, but not to all objects"
                )
            bodies = {body for body, _ in first.solids}
            pairs = self._between(first, lambda *place: place[0] not in bodies, {}, reach)
            return min(pairs, default=None)
        second = self._split(others)
        if len(ones) == len(others) == 1 and (ones[0] is others[0] or first.solids.keys() & second.solids.keys()):
            raise ValueError(f"'{ones[0].name}' and '{others[0].name}' are parts of one rigid body")
        back = self._to_solids(second.points, first.solids, reach)
        pairs = itertools.chain(
            self._between(first, lambda *place: place in second.solids, second.solids, reach),
            self._to_solids(first.points, second.solids, reach),
            (Nearest(pair.distance, pair.end, pair.start, pair.name, pair.own) for pair in back),
            _between_points(first.points, second.points, reach),
        )
        return min(pairs, default=None)

    def _split(self, objects: Sequence[SceneObject]) -> _Sorted:
        result = _Sorted({}, [])
        for item in objects:
            solid = self._solid(item)
            if solid is None:
                result.points.append(item)
            else:
                result.solids.setdefault(solid, item.name)
        return result

    def _to_solids(
        self, points: Sequence[SceneObject], solids: Mapping[_Solid, str], reach: float
    ) -> Iterator[Nearest]:
        """Yield, for each point, the nearest point on every solid that is at most `reach` (m) away."""
        for item in points if solids else ():
            start = frames.position(item.matrix())
            queries = self._context.world.queries
            for met in queries.nearest_points(start, reach, lambda *place: place in solids, measured=True):
                name = solids[met.body, met.link]
                yield Nearest(math.dist(start, met.point), start, met.point, item.name, name)

    def _between(
        self, objects: _Sorted, counts: Callable[[int, int], bool], names: Mapping[_Solid, str], reach: float
    ) -> Iterator[Nearest]:
        """Yield for each of the solids the nearest body for which `counts` is true."""
        for solid, name in objects.solids.items():
            gaps = self._context.world.queries.gaps(*solid, reach, counts)
            best: Gap | None = min(gaps, key=lambda gap: gap.distance, default=None)
            if best is not None:
                other_name = names.get((best.body, best.link)) or self._context.name_of(best.body, best.link)
                yield Nearest(max(0.0, best.distance), best.own_point, best.point, name, other_name)

    def _solid(self, item: SceneObject) -> _Solid | None:
        """Return the solid of an object, or of its vehicle's body if it is part of a vehicle; None for a point."""
        if isinstance(item, ShapeObject):
            return item.number, item.link
        if item.name == "Floor":
            return self._context.body_of("Floor"), -1
        number = getattr(_carrier(item).body, "number", None)
        return None if number is None else (number, -1)


def _between_points(ones: Sequence[SceneObject], others: Sequence[SceneObject], reach: float) -> Iterator[Nearest]:
    for first, second in itertools.product(ones, others):
        start, end = frames.position(first.matrix()), frames.position(second.matrix())
        distance = math.dist(start, end)
        if first is not second and distance <= reach:
            yield Nearest(distance, start, end, first.name, second.name)


def _carrier(item: SceneObject) -> SceneObject:
    """Return the object with the body that `item` is part of: a vehicle's propellers and base are parts of its body."""
    parent = item.parent
    if item.body is not None or parent is None:
        return item
    is_part = plain(item.name).startswith(_PARTS) or getattr(item, "is_part", False)
    return _carrier(parent) if is_part or "force_sensor" in (item.kind, parent.kind) else item
