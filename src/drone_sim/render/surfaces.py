"""Conversion of shapes into triangles with normals and materials for the renderer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drone_sim.files import images
from drone_sim.files.mesh_files import WHITE
from drone_sim.shapes.shape import Rgba, Triangles
from drone_sim.shapes.visual import Visual

CREASE = np.radians(40.0)  # faces that meet at a sharper angle keep a visible edge
MOST_FACES = 32  # at a point; where more meet, as in the middle of a disc, normals are not averaged


@dataclass(frozen=True)
class Surface:
    """The triangles of one material, in the visual's frame, metres.

    vertices, normals: (n, 3) float32; uv: (n, 2) float32, v upwards, or None; faces: (m, 3) uint32;
    rgba: 0..1; texture: (h, w, 3 or 4) uint8, top row first, or None; it is None if uv is.
    closed: the faces enclose a volume and are counter-clockwise seen from outside.
    """

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None = None
    rgba: Rgba = WHITE
    texture: np.ndarray | None = None
    closed: bool = False

    @property
    def transparent(self) -> bool:
        """Whether objects behind it are visible through it."""
        return self.rgba[3] < 1.0 or (
            self.texture is not None and self.texture.shape[2] == 4 and int(self.texture[:, :, 3].min()) < 255
        )


def load(visual: Visual) -> tuple[Surface, ...]:
    """Return the visual's surfaces, one per material, without `visual.rgba`.

    A texture needs uv coordinates; shapes without them ignore it.
    Raises ValueError, in one line that names the file, for a mesh or texture that cannot be read.
    """
    texture = images.read(visual.texture) if visual.texture else None
    return tuple(
        _assemble(part if texture is None else part._replace(rgba=WHITE, texture=texture))
        for part in visual.shape.triangles()
    )


def _assemble(part: Triangles) -> Surface:
    """Return an indexed mesh of the triangles, with normals; equal corners are merged."""
    corners, uv, rgba, texture = part
    normals = crease_normals(corners).reshape(-1, 3)
    table, keys = [corners.reshape(-1, 3), normals], [_points(corners).ravel(), _number_rows(normals)]
    if uv is None or texture is None:
        uv = texture = None
    else:
        table.append(uv.reshape(-1, 2))
        keys.append(_number_rows(uv.reshape(-1, 2)))
    inverse = _number_rows(np.column_stack(keys), digits=0)
    first = np.unique(inverse, return_index=True)[1]
    merged = [np.ascontiguousarray(column[first], dtype=np.float32) for column in table]
    return Surface(
        vertices=merged[0],
        normals=merged[1],
        faces=inverse.reshape(-1, 3).astype(np.uint32),
        uv=None if uv is None else merged[2],
        rgba=rgba,
        texture=texture,
        closed=is_closed(corners),
    )


def crease_normals(corners: np.ndarray, crease: float = float(CREASE)) -> np.ndarray:
    """Return unit normals (m, 3, 3) at the corners of triangles (m, 3, 3).

    A corner's normal is the mean over the faces at that point whose normals differ from that of the corner's face by
    less than `crease` rad. The faces are weighted by their angles at the point, so that the diagonal along which a quad
    was split does not matter. Round objects look round and edges stay sharp, whatever normals the file has.
    """
    area = _areas(corners)
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-30)
    point = _points(corners).ravel()
    order = np.argsort(point, kind="stable")  # the corners at one point are consecutive
    unit = np.repeat(unit, 3, axis=0)[order]
    share = unit * _angles(corners).reshape(-1, 1)[order]
    count_at_point = np.bincount(point)
    count, start = count_at_point[point[order]], (np.cumsum(count_at_point) - count_at_point)[point[order]]
    total, active = share.copy(), np.flatnonzero(count <= MOST_FACES)
    rank, near = np.arange(len(order)) - start, np.cos(crease)
    for shift in range(1, MOST_FACES):
        active = active[count[active] > shift]
        other = start[active] + (rank[active] + shift) % count[active]
        total[active] += share[other] * (np.einsum("ij,ij->i", unit[active], unit[other]) > near)[:, None]
    normals = np.empty_like(total)
    normals[order] = total
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-30), [0.0, 0.0, 1.0]).reshape(-1, 3, 3)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Return normals (m, 3) with twice the triangle's area as length."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _angles(corners: np.ndarray) -> np.ndarray:
    """Return the interior angles (m, 3), rad."""
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.arctan2(sine, np.einsum("ijk,ijk->ij", ahead, back))


def _points(corners: np.ndarray) -> np.ndarray:
    """Return a number for each corner, (m, 3), equal for corners at the same point."""
    extent = max(float(np.ptp(corners)), 1e-30)
    return _number_rows(corners.reshape(-1, 3) / extent, 6).reshape(-1, 3)


def _number_rows(rows: np.ndarray, digits: int = 5) -> np.ndarray:
    """Return a number for each row, (n,), equal for rows that agree to `digits` decimal places."""
    rounded = np.round(rows * 10.0**digits).astype(np.int64)
    order = np.lexsort(rounded.T)
    starts = np.any(np.diff(rounded[order], axis=0), axis=1)
    numbers = np.zeros(len(rows), dtype=np.int64)
    numbers[order[1:]] = np.cumsum(starts)
    return numbers


def is_closed(corners: np.ndarray) -> bool:
    """Return whether triangles (m, 3, 3) enclose a volume and are counter-clockwise seen from outside.

    They are if every edge occurs once in each direction and the volume, the sum of signed tetrahedra, is positive.
    """
    points = _points(corners)
    points = points[(points != np.roll(points, 1, axis=1)).all(axis=1)]  # triangles of two or one points have no area
    if not len(points):
        return False
    starts, ends = points.ravel(), np.roll(points, -1, axis=1).ravel()
    stride = points.max() + 1
    edges, reversed_edges = np.sort(starts * stride + ends), np.sort(ends * stride + starts)
    volume = np.einsum("ij,ij->", corners[:, 0] - corners[0, 0], _areas(corners))
    return bool((np.diff(edges) > 0).all() and (edges == reversed_edges).all() and volume > 0)
