"""A cylinder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Length
from drone_sim.shapes.shape import (
    DrawnShape,
    Files,
    Geometry,
    Primitive,
    ReportedShape,
    SceneShape,
    Triangles,
    outer,
    turned,
)
from drone_sim.shapes.solid import Solid, round_solid


@dataclass(frozen=True)
class Cylinder(SceneShape, ReportedShape):
    """A cylinder along its z axis; `size` is radius and length."""

    word = "cylinder"
    bullet_type = "GEOM_CYLINDER"

    size: Annotated[tuple[Length, Length], Field(description="2 numbers, [radius, length] in m")]

    def for_bullet(self, files: Files, moves: bool) -> Geometry:
        """Return the geometry; PyBullet has two names for the length."""
        radius, length = self.size
        return Geometry(self.bullet_type, {"radius": radius, "height": length}, {"radius": radius, "length": length})

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Cylinder:
        """Return a cylinder from length and radius, in PyBullet's order."""
        length, radius = dimensions[:2]
        return cls((radius, length))

    def triangles(self) -> tuple[Triangles]:
        radius, length = self.size
        outer_radius, half = outer(radius), length / 2
        return (Triangles(turned([(0, -half), (outer_radius, -half), (outer_radius, half), (0, half)])),)

    def solid(self) -> Solid:
        radius, length = self.size
        return round_solid(np.pi * radius**2 * length, radius**2 / 4 + length**2 / 12, radius**2 / 2)

    def shared(self) -> tuple[DrawnShape, tuple[float, float, float]]:
        radius, length = self.size
        return Cylinder((1.0, 1.0)), (radius, radius, length)

    def for_rviz(self) -> tuple[Primitive, ...]:
        radius, length = self.size
        return (Primitive("cylinder", (2 * radius, 2 * radius, length)),)
