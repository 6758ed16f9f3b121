"""Triangles, and what shapes have in common where they are made of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import trimesh

from drone_sim.files.mesh_files import WHITE

Rgba = tuple[float, float, float, float]  # 0..1

SECTIONS = 24  # of what is round, around its axis


class Triangles(NamedTuple):
    """One material's triangles, in the shape's frame.

    corners: (m, 3, 3), m, counter-clockwise seen from outside; uv: (m, 3, 2), v upwards, or None; rgba: 0..1;
    texture: (h, w, 3 or 4) uint8, top row first, or None.
    """

    corners: np.ndarray
    uv: np.ndarray | None = None
    rgba: Rgba = WHITE
    texture: np.ndarray | None = None


def corners_of(mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the corners (m, 3, 3) of a mesh's triangles."""
    return np.asarray(mesh.vertices, dtype=np.float64)[np.asarray(mesh.faces)]


def outer(radius: float) -> float:
    """Return the circumradius of the polygon that has the area of the circle: silhouettes agree on average."""
    angle = 2.0 * np.pi / SECTIONS
    return float(radius * np.sqrt(angle / np.sin(angle)))
