"""A plane without end, as URDFs may hold one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drone_sim.shapes.shape import Primitive, ReportedShape, Triangles

_SIZE = 400.0  # m; a camera sees 100 m
_SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
_IN_RVIZ = 200.0  # m, its side
_FLAT = 1e-3  # m, its thickness there


@dataclass(frozen=True)
class Plane(ReportedShape):
    """The xy plane, seen from above; `size` is the side of what is drawn of it, `tile` that of a texture, m."""

    word = "plane"
    bullet_type = "GEOM_PLANE"
    has_uv = True

    size: float = _SIZE
    tile: float = 1.0

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Plane:
        """Return the plane: PyBullet's has no size."""
        return cls()

    def triangles(self) -> tuple[Triangles]:
        """Return two triangles."""
        corners = self.size * _SQUARE[np.array([[0, 1, 2], [0, 2, 3]])]
        return (Triangles(corners, corners[:, :, :2] / self.tile),)

    def for_rviz(self) -> tuple[Primitive]:
        """Return a thin slab."""
        return (Primitive("cube", (_IN_RVIZ, _IN_RVIZ, _FLAT)),)
