"""A proximity sensor: it detects the nearest point in its volume.

For a ray the point is exact to 1 mm. In the other volumes it is the nearest hit of a fan of about 450 rays, refined
around the best ray, or the point of a body that is nearest to the sensor, if that is inside the volume. An object that
is thinner than the gap between rays (1/24 of the cross section) and has its nearest point outside may be missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Length, ParameterError, Unit, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.volume import Spot, Volume
from drone_sim.scene.bodies import bodies_above
from drone_sim.scene.entry import KindParameters, Place
from drone_sim.scripting.api.sensors import EVERYTHING
from drone_sim.world import World
from drone_sim.world.queries import SurfacePoint

_REFINEMENTS = 5  # number of refinements around the best ray
_REFINEMENT_FACTOR = 3.0  # factor by which each refinement reduces the spacing of the rays
_REQUIRED_KEY = {"cone": "angle", "disc": "angle", "pyramid": "angle", "cylinder": "radius"}
_MAX_ANGLE = {"cone": math.tau, "disc": math.tau, "pyramid": 3.1}  # rad


class ProximitySensorParameters(KindParameters):
    """A proximity sensor: `range`, `offset` (m), and the full `angle` (rad) or `radius` (m) that its type needs."""

    kind: Literal["proximity_sensor"]
    type: Literal["ray", "cone", "disc", "cylinder", "pyramid"]
    range: Length
    offset: Annotated[Finite, Within(0, 1e4), Unit("m")] = 0.0
    angle: Annotated[Finite, Within(0, 6.3), Unit("rad")] = 0.0
    radius: Annotated[Finite, Within(0, 1e4), Unit("m")] = 0.0

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError for a missing angle or radius, or too large an angle."""
        super().model_post_init(context)
        required = _REQUIRED_KEY.get(self.type)
        if required is not None and not getattr(self, required):
            raise ParameterError(f"must be greater than 0 for a {self.type}", (required,), "0")
        maximum = _MAX_ANGLE.get(self.type, math.inf)
        if self.angle > maximum:
            raise ParameterError(f"must be at most {maximum:.4g} rad", ("angle",), f"{self.angle:g}")

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return ProximitySensor(place, Volume(self.type, self.range, self.offset, self.angle, self.radius), context)


class Detection(NamedTuple):
    """A detected point: distance (m), point (m) and unit normal in the sensor's frame; the object's name or ''."""

    distance: float
    point: Vector
    name: str
    normal: Vector


class ProximitySensor(SceneObject):
    """Detects objects on request, except the bodies of its ancestors."""

    def __init__(self, place: Place, volume: Volume, context: SimulationContext):
        super().__init__(*place, kind="proximity_sensor")
        self.volume = volume
        self.entity = EVERYTHING
        self._context = context

    def save_state(self) -> Restore:
        return in_turn(super().save_state(), saved(self, "entity"))

    def detect(self, wanted: Callable[[str], bool] = lambda _: True) -> Detection | None:
        """Return the nearest point of an object whose name is `wanted`, or None."""
        context = self._context
        context.carried.follow()
        carriers = bodies_above(self)
        matrix, volume, step = self.matrix(), self.volume, self.volume.step
        search = _Search(
            context.world,
            matrix,
            volume,
            lambda body, link: body not in carriers and wanted(context.name_of(body, link)),
        )
        best = min([*search.along(volume.spots()), *search.inside()], default=None)
        if best is None:
            return None
        for _ in range(_REFINEMENTS if step else 0):
            best = min([best, *search.along(volume.spots_around(volume.spot(best.point), step))])
            step /= _REFINEMENT_FACTOR
        name = context.name_of(best.body, best.link)
        return Detection(best.distance, best.point, name, frames.rotate_back(matrix, best.normal))


class _Hit(NamedTuple):
    """A hit, ordered by distance; the point is in the sensor's frame, the normal in the world's."""

    distance: float
    point: Vector
    normal: Vector
    body: int
    link: int


class _Search(NamedTuple):
    world: World
    matrix: Matrix
    volume: Volume
    counts: Callable[[int, int], bool]

    def along(self, spots: Sequence[Spot]) -> list[_Hit]:
        """Return the hits of the rays through these spots."""
        rays = [self.volume.ray(spot) for spot in spots]
        ends = [(frames.transform(self.matrix, start), frames.transform(self.matrix, end)) for start, end in rays]
        return [self._hit(hit) for hit in self.world.queries.rays(ends, self.counts)]

    def inside(self) -> list[_Hit]:
        """Return the nearest point of each body, if it is inside the volume."""
        if self.volume.type in ("ray", "disc"):
            return []
        origin, reach = frames.position(self.matrix), self.volume.reach
        hits = [self._hit(met) for met in self.world.queries.nearest_points(origin, reach, self.counts)]
        return [hit for hit in hits if self.volume.holds(hit.point)]

    def _hit(self, hit: SurfacePoint) -> _Hit:
        point = frames.transform(frames.invert(self.matrix), hit.point)
        return _Hit(math.hypot(*point), point, hit.normal, hit.body, hit.link)
