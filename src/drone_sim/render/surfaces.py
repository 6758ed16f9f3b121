"""Triangles with normals and materials: what the renderer makes of a shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drone_sim.files import images
from drone_sim.files.mesh_part import WHITE
from drone_sim.shapes.shape import Rgba, Triangles
from drone_sim.shapes.visual import Visual

CREASE = np.radians(40.0)  # faces that meet more sharply than this keep an edge
MOST_FACES = 32  # at a point; where more meet, as in the middle of a disc, each keeps its own normal


@dataclass(frozen=True)
class Surface:
    """One material's triangles, in the visual's frame, metres.

    vertices, normals: (n, 3) float32; uv: (n, 2) float32, v upwards, or None; faces: (m, 3) uint32;
    rgba: 0..1; texture: (h, w, 3 or 4) uint8, top row first, or None; never one without uv.
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
        """Whether anything behind it can be seen through it."""
        return self.rgba[3] < 1.0 or (
            self.texture is not None and self.texture.shape[2] == 4 and int(self.texture[:, :, 3].min()) < 255
        )


def load(visual: Visual) -> tuple[Surface, ...]:
    """The visual's surfaces, one per material; its own rgba is not applied.

    A texture shows on shapes that bring uv coordinates: elsewhere there is nothing to lay it by and it is left out.
    Raises ValueError, in one line that names the file, for a mesh or texture that cannot be read.
    """
    texture = images.read(visual.texture) if visual.texture else None
    return tuple(
        _assemble(part if texture is None else part._replace(rgba=WHITE, texture=texture))
        for part in visual.shape.triangles()
    )


def _assemble(part: Triangles) -> Surface:
    """Index the corners of loose triangles, with normals, merging those that are alike."""
    corners, uv, rgba, texture = part
    normals = crease_normals(corners).reshape(-1, 3)
    table, alike = [corners.reshape(-1, 3), normals], [_points(corners).ravel(), _numbered(normals)]
    if uv is None or texture is None:
        uv = texture = None
    else:
        table.append(uv.reshape(-1, 2))
        alike.append(_numbered(uv.reshape(-1, 2)))
    inverse = _numbered(np.column_stack(alike), digits=0)
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
    """Unit normals (m, 3, 3) at the corners of triangles (m, 3, 3).

    A corner's normal is the mean, weighted by the angles there (so that it does not matter which way a quad was
    cut), over the faces at that point which are turned from its own by less than `crease` rad: round things
    look round and edges stay sharp, whatever the file's own normals say.
    """
    area = _areas(corners)
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-30)
    point = _points(corners).ravel()
    order = np.argsort(point, kind="stable")  # the corners at one point stand beside each other
    unit = np.repeat(unit, 3, axis=0)[order]
    share = unit * _angles(corners).reshape(-1, 1)[order]
    many = np.bincount(point)
    count, start = many[point[order]], (np.cumsum(many) - many)[point[order]]
    total, here = share.copy(), np.flatnonzero(count <= MOST_FACES)
    rank, near = np.arange(len(order)) - start, np.cos(crease)
    for shift in range(1, MOST_FACES):
        here = here[count[here] > shift]
        other = start[here] + (rank[here] + shift) % count[here]
        total[here] += share[other] * (np.einsum("ij,ij->i", unit[here], unit[other]) > near)[:, None]
    normals = np.empty_like(total)
    normals[order] = total
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-30), [0.0, 0.0, 1.0]).reshape(-1, 3, 3)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Normals (m, 3) as long as twice the triangles' areas."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _angles(corners: np.ndarray) -> np.ndarray:
    """Interior angles (m, 3), rad."""
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.arctan2(sine, np.einsum("ijk,ijk->ij", ahead, back))


def _points(corners: np.ndarray) -> np.ndarray:
    """A number (m, 3) for each corner, the same where corners meet."""
    extent = max(float(np.ptp(corners)), 1e-30)
    return _numbered(corners.reshape(-1, 3) / extent, 6).reshape(-1, 3)


def _numbered(rows: np.ndarray, digits: int = 5) -> np.ndarray:
    """A number (n,) for each row of numbers, the same for rows that agree to so many digits."""
    whole = np.round(rows * 10.0**digits).astype(np.int64)
    order = np.lexsort(whole.T)
    starts = np.any(np.diff(whole[order], axis=0), axis=1)
    numbers = np.zeros(len(rows), dtype=np.int64)
    numbers[order[1:]] = np.cumsum(starts)
    return numbers


def is_closed(corners: np.ndarray) -> bool:
    """Whether triangles (m, 3, 3) enclose a volume, all seen counter-clockwise from outside.

    They do when every edge is run through once in each direction and the volume, the sum of the signed
    tetrahedra to the origin, is positive.
    """
    point = _points(corners)
    point = point[(point != np.roll(point, 1, axis=1)).all(axis=1)]  # slivers have no area to see
    if not len(point):
        return False
    start, end = point.ravel(), np.roll(point, -1, axis=1).ravel()
    most = point.max() + 1
    edges, back = np.sort(start * most + end), np.sort(end * most + start)
    volume = np.einsum("ij,ij->", corners[:, 0] - corners[0, 0], _areas(corners))
    return bool((np.diff(edges) > 0).all() and (edges == back).all() and volume > 0)
