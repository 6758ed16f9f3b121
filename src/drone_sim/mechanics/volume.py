"""The volumes of V-REP's proximity sensors: which rays fill them, and what lies inside. Metres, the sensor's frame.

A sensor looks along z from its origin. A volume begins `offset` away, and ends `range` further. `ray` is a line,
`disc` a fan in the xz plane, `cone` and `pyramid` widen from the origin, by their full angle, `cylinder` has a radius.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from drone_sim.mechanics.frames import Vector

_RINGS = 12
_ACROSS = 21  # rays along each side of a pyramid
_FAN = 181
_AROUND = 3  # rays to either side of the best one, when it is looked at more closely
_EPSILON = 1e-9

Spot = tuple[float, float]  # of a ray in the cross section: from -1 to 1 each
Ray = tuple[Vector, Vector]


@dataclass(frozen=True)
class Volume:
    """A sensor's volume; `angle` in rad, `radius` in m, where its type has one."""

    type: str
    range: float
    offset: float = 0.0
    angle: float = 0.0
    radius: float = 0.0

    @property
    def step(self) -> float:
        """How far apart the rays are in the cross section, which is 2 wide."""
        return {"ray": 0.0, "disc": 2 / (_FAN - 1), "pyramid": 2 / (_ACROSS - 1)}.get(self.type, 1 / _RINGS)

    def spots(self) -> list[Spot]:
        """Return where in the cross section there are rays."""
        if self.type == "ray":
            return [(0.0, 0.0)]
        if self.type == "disc":
            return [(-1 + 2 * one / (_FAN - 1), 0.0) for one in range(_FAN)]
        if self.type == "pyramid":
            side = [-1 + 2 * one / (_ACROSS - 1) for one in range(_ACROSS)]
            return list(itertools.product(side, side))
        return [(0.0, 0.0), *_rings()]

    def spots_around(self, spot: Spot, step: float) -> list[Spot]:
        """Return where there are rays around another one, within `step`."""
        side = [step * one / _AROUND for one in range(-_AROUND, _AROUND + 1)]
        found = {self._inside(spot[0] + u, spot[1] + v) for u, v in itertools.product(side, side)}
        return sorted(found)

    def _inside(self, u: float, v: float) -> Spot:
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
        lean = math.hypot(u, v) * self.angle / 2
        around = math.atan2(v, u)
        x, y, z = math.sin(lean) * math.cos(around), math.sin(lean) * math.sin(around), math.cos(lean)
        return (near * x, near * y, near * z), (far * x, far * y, far * z)

    def spot(self, point: Vector) -> Spot:
        """Return where in the cross section the ray through a point inside is."""
        x, y, z = point
        if self.type == "cylinder":
            return x / self.radius, y / self.radius
        if self.type == "pyramid":
            wide = z * math.tan(self.angle / 2)
            return x / wide, y / wide
        aside = math.hypot(x, y)
        share = math.atan2(aside, z) / (self.angle / 2) / (aside or 1.0) if self.angle else 0.0
        return x * share, y * share

    def holds(self, point: Vector) -> bool:
        """Tell whether a point is inside."""
        x, y, z = point
        aside, near, far = math.hypot(x, y), self.offset - _EPSILON, self.offset + self.range + _EPSILON
        if self.type == "cylinder":
            return near <= z <= far and aside <= self.radius
        if self.type == "pyramid":
            wide = z * math.tan(self.angle / 2)
            return near <= z <= far and abs(x) <= wide and abs(y) <= wide
        if self.type == "cone":
            return near <= math.hypot(aside, z) <= far and math.atan2(aside, z) <= self.angle / 2
        return False  # of no thickness

    @property
    def reach(self) -> float:
        """How far from the origin its farthest point is."""
        return math.hypot(*self.ray((1.0, 1.0) if self.type == "pyramid" else (1.0, 0.0))[1])


def _rings() -> Iterator[Spot]:
    for ring in range(1, _RINGS + 1):
        for one in range(6 * ring):
            angle = math.tau * one / (6 * ring)
            yield ring / _RINGS * math.cos(angle), ring / _RINGS * math.sin(angle)
