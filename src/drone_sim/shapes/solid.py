"""The volume of a shape, its centroid and inertia."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

_THIN = 1e-9  # fraction of the bounds' volume; a thinner hull counts as a box of its bounds
_THICKNESS = 1e-4  # m, of that box if the bounds are flat


class Solid(NamedTuple):
    """A volume (m³), its centroid (3,), m, and its inertia tensor (3, 3) about that at 1 kg/m³, kg m²."""

    volume: float
    centroid: np.ndarray
    inertia: np.ndarray


def round_solid(volume: float, xx: float, zz: float) -> Solid:
    """Return a centred solid of revolution about z, from its radii of gyration squared (m²)."""
    return Solid(volume, np.zeros(3), volume * np.diag([xx, xx, zz]))


def hull_of(corners: Sequence[np.ndarray]) -> Solid:
    """Return the convex hull of triangles (m, 3, 3), as a solid; for a flat hull, a thin box of its bounds."""
    return _hull_of(np.concatenate(corners, dtype=float).tobytes())


@lru_cache(maxsize=64)  # scenes have many equal shapes
def _hull_of(corners: bytes) -> Solid:
    import trimesh  # late: takes longer to import than everything else
    from manifold3d import Manifold

    points = np.frombuffer(corners).reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    extents = np.maximum(high - low, _THICKNESS)
    hull = Manifold.hull_points(points)
    if hull.volume() > _THIN * np.prod(extents):
        hull_mesh = hull.to_mesh64()
        solid = trimesh.Trimesh(hull_mesh.vert_properties, hull_mesh.tri_verts, process=False)
    else:
        solid = trimesh.creation.box(extents, trimesh.transformations.translation_matrix((low + high) / 2))
    return Solid(float(solid.volume), np.asarray(solid.center_mass), np.asarray(solid.moment_inertia))
