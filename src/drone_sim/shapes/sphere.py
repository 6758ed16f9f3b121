"""A sphere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Length
from drone_sim.shapes.shape import Files, Geometry, Primitive, ReportedShape, SceneShape, Triangles, half_circle, turned
from drone_sim.shapes.solid import Solid, round_solid

_SECTIONS = 32  # finer than other shapes: only its outline shows that it is round; this many faces meet at a pole
_CORNERS = turned(half_circle(1.0, sections=_SECTIONS), _SECTIONS)
_CORNERS *= np.cbrt(4 / 3 * np.pi / (np.linalg.det(_CORNERS).sum() / 6))  # the volume of the unit sphere


@dataclass(frozen=True)
class Sphere(SceneShape, ReportedShape):
    """A sphere; `size` is its radius."""

    word = "sphere"
    bullet_type = "GEOM_SPHERE"

    size: Annotated[tuple[Length], Field(description="a list of 1 number, [radius] in m")]

    def for_bullet(self, files: Files, moves: bool) -> Geometry:
        """Return the geometry, by its radius."""
        radius = {"radius": self.size[0]}
        return Geometry(self.bullet_type, radius, radius)

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Sphere:
        """Return a sphere; the first of `dimensions` is its radius."""
        return cls((dimensions[0],))

    def triangles(self) -> tuple[Triangles]:
        return (Triangles(_CORNERS * self.size[0]),)

    def solid(self) -> Solid:
        (radius,) = self.size
        return round_solid(4 / 3 * np.pi * radius**3, 2 / 5 * radius**2, 2 / 5 * radius**2)

    def shared(self) -> tuple[Sphere, tuple[float, float, float]]:
        (radius,) = self.size
        return Sphere((1.0,)), (radius, radius, radius)

    def for_rviz(self) -> tuple[Primitive]:
        diameter = 2 * self.size[0]
        return (Primitive("sphere", (diameter, diameter, diameter)),)
