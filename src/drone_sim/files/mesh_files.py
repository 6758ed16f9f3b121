"""Meshes from files, read once for whoever needs them: the renderer draws them, the world makes bodies."""

from __future__ import annotations

import numpy as np

from drone_sim.files.mesh_part import MeshPart
from drone_sim.files.resources import MEBIBYTE, FileCache, ReadFile

_HULL = 256  # corners that a hull may have


def read(path: str) -> tuple[MeshPart, ...]:
    """Return a mesh file's parts, placed as the file says. Raises ValueError, in one line that names the file."""
    return _CACHE.get(path)


def triangles(path: str) -> int:
    """Return how many triangles a mesh file holds. Raises what `read` raises."""
    return sum(len(part.faces) for part in read(path))


def reach(path: str) -> np.ndarray:
    """Return how far a mesh file's vertices are from its origin along x, y and z, (3,), m; raises what `read` does."""
    return np.max([np.abs(part.vertices).max(axis=0) for part in read(path)], axis=0)


def as_stl(path: str, hull: bool = False) -> bytes:
    """Return a mesh file as a binary STL, all parts in one; of a `hull` only its corners matter.

    Raises what `read` raises.
    """
    corners = np.concatenate([part.vertices[part.faces] for part in read(path)])
    return stl(_hull(corners) if hull else corners)


def stl(corners: np.ndarray) -> bytes:
    """Return triangles (m, 3, 3), m, as a binary STL."""
    records = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    records["normal"] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    records["corners"] = corners
    return bytes(80) + np.uint32(len(records)).tobytes() + records.tobytes()


def _hull(corners: np.ndarray) -> np.ndarray:
    """Return triangles (m, 3, 3) with the same convex hull; of a body with many corners, with nearly the same.

    Bullet asks every point of a hull again and again: 100 000 of them bring a step to a standstill.
    """
    points = np.unique(corners.reshape(-1, 3), axis=0) if len(corners) < 20_000 else corners.reshape(-1, 3)
    if len(points) <= _HULL:
        return corners
    import trimesh  # which has read the file

    directions = trimesh.creation.icosphere(subdivisions=2).vertices
    farthest = np.unique([np.argmax(points @ direction) for direction in directions])
    return np.resize(points[farthest], (-(-len(farthest) // 3), 3, 3))


def _read(path: str) -> ReadFile:
    from drone_sim.files import mesh_reader  # trimesh

    return mesh_reader.read(path)


_CACHE: FileCache[tuple[MeshPart, ...]] = FileCache(_read, 256 * MEBIBYTE)
