"""A capsule, as URDFs may hold one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import trimesh

from drone_sim.mechanics.frames import from_rpy
from drone_sim.shapes.primitive import Primitive
from drone_sim.shapes.shape import ReportedShape
from drone_sim.shapes.triangles import SECTIONS, Triangles, corners_of, outer


@dataclass(frozen=True)
class Capsule(ReportedShape):
    """A cylinder along its z axis with half a sphere on each end; `size` is radius and length without them, m."""

    word = "capsule"
    bullet_type = "GEOM_CAPSULE"

    size: tuple[float, float]

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Capsule:
        """Return the capsule of this length and radius, which is PyBullet's order."""
        length, radius = dimensions[:2]
        return cls((radius, length))

    def triangles(self) -> tuple[Triangles]:
        """Return as many sections along the caps as around them."""
        radius, length = self.size
        capsule = trimesh.creation.capsule(length, outer(radius), count=[SECTIONS, SECTIONS])
        return (Triangles(corners_of(capsule)),)

    def for_rviz(self) -> tuple[Primitive, ...]:
        """Return a cylinder and two spheres."""
        radius, length = self.size
        wide = 2 * radius
        ends = [from_rpy((0, 0, sign * length / 2), (0, 0, 0)) for sign in (-1, 1)]
        return (
            Primitive("cylinder", (wide, wide, length)),
            *(Primitive("sphere", (wide, wide, wide), end) for end in ends),
        )
