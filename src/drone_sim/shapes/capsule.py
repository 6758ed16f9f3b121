"""A capsule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Length
from drone_sim.mechanics.frames import from_rpy
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.shape import DrawnShape, Primitive, Triangles, half_circle, outer, turned
from drone_sim.shapes.solid import Solid, round_solid


@dataclass(frozen=True)
class Capsule(Cylinder):
    """A cylinder along its z axis with a hemisphere on each end; `size` is radius and length without these, m."""

    word = "capsule"
    bullet_type = "GEOM_CAPSULE"

    size: Annotated[tuple[Length, Length], Field(description="2 numbers, [radius, length without the caps] in m")]

    def triangles(self) -> tuple[Triangles]:
        """Return as many sections along the caps as around them."""
        radius, length = self.size
        return (Triangles(turned(half_circle(outer(radius), length))),)

    def solid(self) -> Solid:
        """Return a cylinder and two hemispheres, with centroids 3/8 of the radius away from their flat sides."""
        r, length = self.size
        cylinder, ball = np.pi * r**2 * length, 4 / 3 * np.pi * r**3
        arm = (length / 2 + 3 / 8 * r) ** 2 - (3 / 8 * r) ** 2
        xx = cylinder * (r**2 / 4 + length**2 / 12) + ball * (2 / 5 * r**2 + arm)
        zz = cylinder * r**2 / 2 + ball * 2 / 5 * r**2
        volume = cylinder + ball
        return round_solid(volume, xx / volume, zz / volume)

    def shared(self) -> tuple[DrawnShape, tuple[float, float, float]]:
        """Return the capsule itself: scaled along z its caps would not be round."""
        return self, (1.0, 1.0, 1.0)

    def for_rviz(self) -> tuple[Primitive, ...]:
        """Return a cylinder and two spheres."""
        radius, length = self.size
        diameter = 2 * radius
        ends = [from_rpy((0, 0, sign * length / 2), (0, 0, 0)) for sign in (-1, 1)]
        return (*super().for_rviz(), *(Primitive("sphere", (diameter, diameter, diameter), end) for end in ends))
