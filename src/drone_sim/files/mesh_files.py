"""Meshes from files: limits, a cache shared by the renderer and the world, and conversion to STL."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drone_sim.files.resources import MEBIBYTE, FileCache, ReadFile

KINDS = (".obj", ".stl", ".dae")
MAX_SIZE = 32 * MEBIBYTE  # bytes of a mesh file, and of each file that it refers to
MAX_TRIANGLES = 200_000  # of a file
MAX_PARTS = 256  # materials, or nodes of a COLLADA scene
MAX_COORDINATE = 1e6  # m from the mesh's origin
WHITE = (1.0, 1.0, 1.0, 1.0)
Colour = tuple[float, float, float, float]

_MAX_HULL_POINTS = 256


class MeshPart(NamedTuple):
    """Triangles of one material, in metres.

    vertices: (n, 3) float64; faces: (m, 3); uv: (n, 2), v upwards, or None; rgba: 0..1; texture: (h, w, 3 or 4)
    uint8, top row first, or None.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None
    rgba: Colour
    texture: np.ndarray | None

    @property
    def nbytes(self) -> int:
        """Memory of the arrays, in bytes."""
        arrays = (self.vertices, self.faces, self.uv, self.texture)
        return sum(array.nbytes for array in arrays if array is not None)


def read(path: str) -> tuple[MeshPart, ...]:
    """Return the parts of a mesh file in its root frame. Raises ValueError, in one line with the file's name."""
    return _CACHE.get(path)


def triangles(path: str) -> int:
    """Return the number of triangles in a mesh file. Raises what `read` raises."""
    return sum(len(part.faces) for part in read(path))


def reach(path: str) -> np.ndarray:
    """Return the largest absolute x, y and z of a mesh file's vertices, (3,), m. Raises what `read` raises."""
    return np.max([np.abs(part.vertices).max(axis=0) for part in read(path)], axis=0)


def as_stl(path: str, hull: bool = False) -> bytes:
    """Return all parts of a mesh file as one binary STL. If `hull`, only the STL's convex hull is that of the mesh.

    Raises what `read` raises.
    """
    corners = np.concatenate([part.vertices[part.faces] for part in read(path)])
    return stl(_reduce_hull(corners) if hull else corners)


def stl(corners: np.ndarray) -> bytes:
    """Return triangles (m, 3, 3), m, as a binary STL."""
    records = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    records["normal"] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    records["corners"] = corners
    return bytes(80) + np.uint32(len(records)).tobytes() + records.tobytes()


def _reduce_hull(corners: np.ndarray) -> np.ndarray:
    """Return triangles (m, 3, 3) with the same convex hull; above _MAX_HULL_POINTS points, with nearly the same.

    Bullet visits every point of a hull in each collision test: with 100 000 points a step takes minutes.
    """
    points = np.unique(corners.reshape(-1, 3), axis=0) if len(corners) < 20_000 else corners.reshape(-1, 3)
    if len(points) <= _MAX_HULL_POINTS:
        return corners
    import trimesh  # slow import

    directions = trimesh.creation.icosphere(subdivisions=2).vertices
    farthest = np.unique([np.argmax(points @ direction) for direction in directions])
    return np.resize(points[farthest], (-(-len(farthest) // 3), 3, 3))


def _read(path: str) -> ReadFile:
    from drone_sim.files import mesh_reader  # slow import: trimesh

    return mesh_reader.read(path)


_CACHE: FileCache[tuple[MeshPart, ...]] = FileCache(_read, 256 * MEBIBYTE)
