"""A proximity sensor: the nearest point of what is in its volume.

The point is exact to 1 mm for a ray. In the other volumes it is the nearest of a fan of some 450 rays, looked at more
closely around the best one, or the point of a body that is nearest to the sensor, where that lies inside: what is
thinner than the gaps between the rays, a 24th of the cross section, and has its nearest point outside may be missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Length, ParameterError, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.volume import Spot, Volume
from drone_sim.scene.bodies import bodies_above
from drone_sim.scene.kinds.kind import KindParameters, Place
from drone_sim.scripting.api.sensors import EVERYTHING
from drone_sim.world import World
from drone_sim.world.queries import Met

_CLOSER = 5  # times that the best ray's surroundings are looked at
_SHRINKS = 3.0  # by which the part that is looked at is smaller each time
_NEEDS = {"cone": "angle", "disc": "angle", "pyramid": "angle", "cylinder": "radius"}
_WIDEST = {"cone": math.tau, "disc": math.tau, "pyramid": 3.1}  # rad


class ProximitySensorParameters(KindParameters):
    """A proximity sensor; `range` and `offset` in m; full `angle` in rad, or `radius` in m, as its type needs."""

    kind: Literal["proximity_sensor"]
    type: Literal["ray", "cone", "disc", "cylinder", "pyramid"]
    range: Length
    offset: Annotated[Finite, Within(0, 1e4)] = 0.0
    angle: Annotated[Finite, Within(0, 6.3)] = 0.0
    radius: Annotated[Finite, Within(0, 1e4)] = 0.0

    def model_post_init(self, context: Any) -> None:
        """Refuse a volume without extent."""
        super().model_post_init(context)
        needed = _NEEDS.get(self.type)
        if needed is not None and not getattr(self, needed):
            raise ParameterError(f"must be greater than 0 for a {self.type}", (needed,), "0")
        widest = _WIDEST.get(self.type, math.inf)
        if self.angle > widest:
            raise ParameterError(f"must be at most {widest:.4g} rad", ("angle",), f"{self.angle:g}")

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the sensor."""
        return ProximitySensor(place, Volume(self.type, self.range, self.offset, self.angle, self.radius), context)


class Detection(NamedTuple):
    """What a sensor has found, in its own frame: how far (m), where, the object's name or '', the unit normal there."""

    distance: float
    point: Vector
    name: str
    normal: Vector


class ProximitySensor(SceneObject):
    """Looks when it is asked; it does not see the bodies that carry it."""

    def __init__(self, place: Place, volume: Volume, context: SimulationContext):
        """Take where it is, what it looks through, and what the simulation shares."""
        super().__init__(*place, kind="proximity_sensor")
        self.volume = volume
        self.entity = EVERYTHING
        self._context = context

    def save_state(self) -> Restore:
        """Return a function that puts it back where it is now, looking for what it looks for now."""
        return in_turn(super().save_state(), saved(self, "entity"))

    def detect(self, wanted: Callable[[str], bool] = lambda _: True) -> Detection | None:
        """Return the nearest point of an object whose name is wanted; None where there is none."""
        context = self._context
        context.carried.follow()
        own = bodies_above(self)
        return self._nearest(lambda body, link: body not in own and wanted(context.name_of(body, link)))

    def _nearest(self, counts: Callable[[int, int], bool]) -> Detection | None:
        matrix, volume, step = self.matrix(), self.volume, self.volume.step
        seek = _Seek(self._context.world, matrix, volume, counts)
        best = min([*seek.along(volume.spots()), *seek.inside()], default=None)
        if best is None:
            return None
        for _ in range(_CLOSER if step else 0):
            best = min([best, *seek.along(volume.spots_around(volume.spot(best.point), step))])
            step /= _SHRINKS
        name = self._context.name_of(best.body, best.link)
        return Detection(best.distance, best.point, name, frames.rotate_back(matrix, best.normal))


class _Found(NamedTuple):
    """A point in the sensor's frame, the nearest first; the normal in the world's."""

    distance: float
    point: Vector
    normal: Vector
    body: int
    link: int


class _Seek(NamedTuple):
    world: World
    matrix: Matrix
    volume: Volume
    counts: Callable[[int, int], bool]

    def along(self, spots: Sequence[Spot]) -> list[_Found]:
        """Return what rays meet."""
        rays = [self.volume.ray(spot) for spot in spots]
        ends = [(frames.transform(self.matrix, start), frames.transform(self.matrix, end)) for start, end in rays]
        return [self._found(met) for met in self.world.queries.rays(ends, self.counts)]

    def inside(self) -> list[_Found]:
        """Return the points of bodies that are nearest to the sensor and lie inside."""
        if self.volume.type in ("ray", "disc"):
            return []
        origin, reach = frames.position(self.matrix), self.volume.reach
        found = [self._found(met) for met in self.world.queries.nearest_points(origin, reach, self.counts)]
        return [one for one in found if self.volume.holds(one.point)]

    def _found(self, met: Met) -> _Found:
        point = frames.transform(frames.invert(self.matrix), met.point)
        return _Found(math.hypot(*point), point, met.normal, met.body, met.link)
