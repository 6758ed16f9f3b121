"""The rays of V-REP's proximity sensors, and whether a point is in their volume. Metres, in the sensor's frame.

A sensor looks along z from its origin; its volume begins at the distance `offset` and is `range` long. `ray` is a line,
`disc` a fan in the xz plane; `cone` and `pyramid` widen from the origin by their full angle; `cylinder` has a radius.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from drone_sim.mechanics.frames import Vector

_RINGS = 12
_SIDE_RAYS = 21  # along each side of a pyramid's cross section
_FAN_RAYS = 181
_FINE_RAYS = 3  # to either side of the best ray, when it is refined
_EPSILON = 1e-9

Spot = tuple[float, float]  # u and v of a ray in the cross section, from -1 to 1
Ray = tuple[Vector, Vector]


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

    def spots(self) -> list[Spot]:
        """Return the places of the rays in the cross section."""
        if self.type == "ray":
            return [(0.0, 0.0)]
        if self.type == "disc":
            return [(-1 + 2 * n / (_FAN_RAYS - 1), 0.0) for n in range(_FAN_RAYS)]
        if self.type == "pyramid":
            side = [-1 + 2 * n / (_SIDE_RAYS - 1) for n in range(_SIDE_RAYS)]
            return list(itertools.product(side, side))
        return [(0.0, 0.0), *_rings()]

    def spots_around(self, spot: Spot, step: float) -> list[Spot]:
        """Return the places of refined rays within `step` of a place in the cross section."""
        side = [step * n / _FINE_RAYS for n in range(-_FINE_RAYS, _FINE_RAYS + 1)]
        spots = {self._clamped(spot[0] + u, spot[1] + v) for u, v in itertools.product(side, side)}
        return sorted(spots)

    def _clamped(self, u: float, v: float) -> Spot:
        if self.type == "disc":
            return max(-1.0, min(1.0, u)), 0.0
        if self.type == "pyramid":
            return max(-1.0, min(1.0, u)), max(-1.0, min(1.0, v))
        length = math.hypot(u, v)
        return (u, v) if length <= 1 else (u / length, v / length)

    def ray(self, spot: Spot) -> Ray:
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

    def spot(self, point: Vector) -> Spot:
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


def _rings() -> Iterator[Spot]:
    for ring in range(1, _RINGS + 1):
        for n in range(6 * ring):
            angle = math.tau * n / (6 * ring)
            yield ring / _RINGS * math.cos(angle), ring / _RINGS * math.sin(angle)
