"""An infinite plane, which a URDF may contain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drone_sim.shapes.shape import Primitive, ReportedShape, Triangles

_SIZE = 400.0  # m, side of the drawn square; cameras see 100 m
_SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])  # triangles of a quadrilateral, as indices of its corners
_RVIZ_SIZE = 200.0  # m, side
_RVIZ_THICKNESS = 1e-3  # m, thickness in rviz


@dataclass(frozen=True)
class Plane(ReportedShape):
    """The xy plane, visible from above, drawn as a square.

    size, tile: sides of the square and of a texture, m. hole: side of a square hole in its middle, m.
    """

    word = "plane"
    bullet_type = "GEOM_PLANE"
    has_uv = True

    size: float = _SIZE
    tile: float = 1.0
    hole: float = 0.0

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Plane:
        """Return a default plane: PyBullet's has no size."""
        return cls()

    def triangles(self) -> tuple[Triangles]:
        """Return two triangles, or eight around a hole."""
        corners = self.size * _SQUARE[_TRIANGLES]
        if self.hole:
            outer, inner = self.size * _SQUARE, self.hole * _SQUARE
            sides = [np.array([outer[n], outer[n - 3], inner[n - 3], inner[n]]) for n in range(4)]
            corners = np.concatenate([side[_TRIANGLES] for side in sides])
        return (Triangles(corners, corners[:, :, :2] / self.tile),)

    def for_rviz(self) -> tuple[Primitive]:
        """Return a thin slab."""
        return (Primitive("cube", (_RVIZ_SIZE, _RVIZ_SIZE, _RVIZ_THICKNESS)),)
