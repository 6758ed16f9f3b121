"""A plane without end, as URDFs may hold one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drone_sim.shapes.shape import Primitive, ReportedShape, Triangles

_SIZE = 400.0  # m; a camera sees 100 m
_SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
_HALVES = np.array([[0, 1, 2], [0, 2, 3]])  # of a quadrilateral, by its corners
_IN_RVIZ = 200.0  # m, its side
_FLAT = 1e-3  # m, its thickness there


@dataclass(frozen=True)
class Plane(ReportedShape):
    """The xy plane, seen from above, as a square.

    size, tile: the sides of the square and of a texture, m. hole: the side of a square hole in its middle, m.
    """

    word = "plane"
    bullet_type = "GEOM_PLANE"
    has_uv = True

    size: float = _SIZE
    tile: float = 1.0
    hole: float = 0.0

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Plane:
        """Return the plane: PyBullet's has no size."""
        return cls()

    def triangles(self) -> tuple[Triangles]:
        """Return two triangles, or eight around a hole."""
        corners = self.size * _SQUARE[_HALVES]
        if self.hole:
            outer, inner = self.size * _SQUARE, self.hole * _SQUARE
            sides = [np.array([outer[n], outer[n - 3], inner[n - 3], inner[n]]) for n in range(4)]
            corners = np.concatenate([side[_HALVES] for side in sides])
        return (Triangles(corners, corners[:, :, :2] / self.tile),)

    def for_rviz(self) -> tuple[Primitive]:
        """Return a thin slab."""
        return (Primitive("cube", (_IN_RVIZ, _IN_RVIZ, _FLAT)),)
