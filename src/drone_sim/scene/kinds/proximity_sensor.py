"""A proximity sensor: it detects the nearest point in its volume.

For a ray the point is exact to 1 mm. In the other volumes it is the nearest hit of a fan of about 450 rays, refined
around the best ray, or the point of a body that is nearest to the sensor, if that is inside the volume. An object that
is thinner than the gap between rays (1/24 of the cross section) and has its nearest point outside may be missed.

A sensor looks along z from its origin; its volume begins at the distance `offset` and is `range` long. `ray` is a line,
`disc` a fan in the xz plane; `cone` and `pyramid` widen from the origin by their full angle; `cylinder` has a radius.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Length, ParameterError, Unit, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import bodies_above
from drone_sim.scene.entry import KindParameters, Place
from drone_sim.scripting.api.sensors import EVERYTHING
from drone_sim.world import World
from drone_sim.world.queries import SurfacePoint

_REFINEMENTS = 5  # number of refinements around the best ray
_REFINEMENT_FACTOR = 3.0  # factor by which each refinement reduces the spacing of the rays
_REQUIRED_KEY = {"cone": "angle", "disc": "angle", "pyramid": "angle", "cylinder": "radius"}
_MAX_ANGLE = {"cone": math.tau, "disc": math.tau, "pyramid": 3.1}  # rad
_RINGS = 12
_SIDE_RAYS = 21  # along each side of a pyramid's cross section
_FAN_RAYS = 181
_FINE_RAYS = 3  # to either side of the best ray, when it is refined
_EPSILON = 1e-9

_Spot = tuple[float, float]  # u and v of a ray in the cross section, from -1 to 1
_Ray = tuple[Vector, Vector]


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


@dataclass(frozen=True)
class Volume:
    """A sensor's volume: `angle` in rad and `radius` in m, if its type has them."""

    type: str
    range: float
    offset: float = 0.0
    angle: float = 0.0
    radius: float = 0.0

    @property
    def step(self) -> float:
        """Distance between rays in the cross section, which is 2 wide."""
        return {"ray": 0.0, "disc": 2 / (_FAN_RAYS - 1), "pyramid": 2 / (_SIDE_RAYS - 1)}.get(self.type, 1 / _RINGS)

    def spots(self) -> list[_Spot]:
        """Return the places of the rays in the cross section."""
        if self.type == "ray":
            return [(0.0, 0.0)]
        if self.type == "disc":
            return [(-1 + 2 * n / (_FAN_RAYS - 1), 0.0) for n in range(_FAN_RAYS)]
        if self.type == "pyramid":
            side = [-1 + 2 * n / (_SIDE_RAYS - 1) for n in range(_SIDE_RAYS)]
            return list(itertools.product(side, side))
        return [(0.0, 0.0), *_rings()]

    def spots_around(self, spot: _Spot, step: float) -> list[_Spot]:
        """Return the places of refined rays within `step` of a place in the cross section."""
        side = [step * n / _FINE_RAYS for n in range(-_FINE_RAYS, _FINE_RAYS + 1)]
        spots = {self._clamped(spot[0] + u, spot[1] + v) for u, v in itertools.product(side, side)}
        return sorted(spots)

    def _clamped(self, u: float, v: float) -> _Spot:
        if self.type == "disc":
            return max(-1.0, min(1.0, u)), 0.0
        if self.type == "pyramid":
            return max(-1.0, min(1.0, u)), max(-1.0, min(1.0, v))
        length = math.hypot(u, v)
        return (u, v) if length <= 1 else (u / length, v / length)

    def ray(self, spot: _Spot) -> _Ray:
        """Return both ends of the ray at a place in the cross section."""
        (u, v), near, far = spot, self.offset, self.offset + self.range
        if self.type == "cylinder":
            x, y = u * self.radius, v * self.radius
            return (x, y, near), (x, y, far)
        if self.type == "pyramid":
            wide = math.tan(self.angle / 2)
            return (u * wide * near, v * wide * near, near), (u * wide * far, v * wide * far, far)
        polar = math.hypot(u, v) * self.angle / 2
        azimuth = math.atan2(v, u)
        x, y, z = math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)
        return (near * x, near * y, near * z), (far * x, far * y, far * z)

    def spot(self, point: Vector) -> _Spot:
        """Return the place in the cross section of the ray through a point in the volume."""
        x, y, z = point
        if self.type == "cylinder":
            return x / self.radius, y / self.radius
        if self.type == "pyramid":
            wide = z * math.tan(self.angle / 2)
            return x / wide, y / wide
        distance = math.hypot(x, y)
        scale = math.atan2(distance, z) / (self.angle / 2) / (distance or 1.0) if self.angle else 0.0
        return x * scale, y * scale

    def holds(self, point: Vector) -> bool:
        """Return whether a point is inside; a ray or a disc has no inside."""
        x, y, z = point
        distance, near, far = math.hypot(x, y), self.offset - _EPSILON, self.offset + self.range + _EPSILON
        if self.type == "cylinder":
            return near <= z <= far and distance <= self.radius
        if self.type == "pyramid":
            wide = z * math.tan(self.angle / 2)
            return near <= z <= far and abs(x) <= wide and abs(y) <= wide
        if self.type == "cone":
            return near <= math.hypot(distance, z) <= far and math.atan2(distance, z) <= self.angle / 2
        return False

    @property
    def reach(self) -> float:
        """Distance of its farthest point from the origin."""
        return math.hypot(*self.ray((1.0, 1.0) if self.type == "pyramid" else (1.0, 0.0))[1])


def _rings() -> Iterator[_Spot]:
    for ring in range(1, _RINGS + 1):
        for n in range(6 * ring):
            angle = math.tau * n / (6 * ring)
            yield ring / _RINGS * math.cos(angle), ring / _RINGS * math.sin(angle)


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

    def along(self, spots: Sequence[_Spot]) -> list[_Hit]:
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
