"""Triangles with normals and materials for every shape a Visual can have; meshes are read by trimesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterator, Optional, Tuple

import cv2
import numpy as np
import trimesh

from drone_sim.visual import Visual

SECTIONS = 24  # of a cylinder or capsule around its axis
PLANE_HALF_SIZE = 200.0  # metres; a plane is infinite, a camera sees 100 m
CREASE = np.radians(40.0)  # faces that meet more sharply than this keep an edge
_SPHERE = 1.0029  # radius of the polyhedron of 1280 faces that has the volume of the unit sphere
WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Mesh:
    """One material's triangles, in the visual's frame, metres.

    vertices, normals: (n, 3) float32; uv: (n, 2) float32, v upwards, or None; faces: (m, 3) uint32;
    rgba: 0..1; texture: (h, w, 3 or 4) uint8, top row first, or None; never one without uv.
    closed: the faces enclose a volume and are counter-clockwise seen from outside.
    """

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    uv: Optional[np.ndarray] = None
    rgba: Tuple[float, float, float, float] = WHITE
    texture: Optional[np.ndarray] = None
    closed: bool = False

    @property
    def transparent(self) -> bool:
        """Whether anything behind it can be seen through it."""
        return self.rgba[3] < 1.0 or (
            self.texture is not None and self.texture.shape[2] == 4 and int(self.texture[:, :, 3].min()) < 255
        )


def load(visual: Visual) -> Tuple[Mesh, ...]:
    """The visual's meshes, one per material; its own rgba is not applied.

    A texture shows on boxes (once per face), planes (once per metre) and meshes that bring uv coordinates;
    on other shapes there is nothing to lay it by and it is left out.
    Raises ValueError, in one line that names the file, for a mesh or texture that cannot be read, and for an
    unknown shape.
    """
    if visual.shape == "mesh":
        return tuple(_read_file(visual))
    uv = None
    if visual.shape == "box":
        corners, uv = _box(visual.size)
    elif visual.shape == "plane":
        corners, uv = _plane()
    elif visual.shape == "cylinder":
        radius, length = visual.size
        corners = _triangles(trimesh.creation.cylinder(_outer(radius), length, sections=SECTIONS))
    elif visual.shape == "sphere":
        corners = _triangles(trimesh.creation.icosphere(subdivisions=3, radius=_SPHERE * visual.size[0]))
    elif visual.shape == "capsule":
        radius, length = visual.size
        corners = _triangles(trimesh.creation.capsule(length, _outer(radius), count=[SECTIONS, SECTIONS]))
    else:
        raise ValueError(f"visual {visual.key}: unknown shape {visual.shape!r}")
    return (_assemble(corners, uv, WHITE, _read_image(visual.texture)),)


def _outer(radius: float) -> float:
    """Circumradius of the polygon that has the area of the circle, so that silhouettes agree on average."""
    angle = 2.0 * np.pi / SECTIONS
    return float(radius * np.sqrt(angle / np.sin(angle)))


def _triangles(mesh: trimesh.Trimesh) -> np.ndarray:
    return np.asarray(mesh.vertices, dtype=np.float64)[np.asarray(mesh.faces)]


def _box(size: Tuple[float, ...]) -> Tuple[np.ndarray, np.ndarray]:
    """Corners (12, 3, 3) and uv (12, 3, 2); each side shows the picture upright (z up) from outside."""
    corners = _triangles(trimesh.creation.box(extents=(1.0, 1.0, 1.0)))
    normals = _areas(corners)
    axis = np.abs(normals).argmax(axis=1)
    sign = np.sign(normals[np.arange(len(normals)), axis])
    x, y, z = np.moveaxis(corners, 2, 0)
    side = sign[:, None]
    right = np.choose(axis[:, None], [side * y, -side * x, x])
    up = np.choose(axis[:, None], [z, z, side * y])
    return corners * np.asarray(size), np.stack([right, up], axis=2) + 0.5


def _plane() -> Tuple[np.ndarray, np.ndarray]:
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * PLANE_HALF_SIZE
    corners = square[np.array([[0, 1, 2], [0, 2, 3]])]
    return corners, corners[:, :, :2]


def _assemble(
    corners: np.ndarray,
    uv: Optional[np.ndarray],
    rgba: Tuple[float, float, float, float],
    texture: Optional[np.ndarray],
) -> Mesh:
    """Index the corners (m, 3, 3) of loose triangles, with normals, merging those that are alike."""
    table = np.hstack([corners.reshape(-1, 3), crease_normals(corners).reshape(-1, 3)])
    if uv is None or texture is None:
        uv = texture = None
    else:
        table = np.hstack([table, uv.reshape(-1, 2)])
    table = table.astype(np.float32)
    _, first, inverse = np.unique(table.round(5), axis=0, return_index=True, return_inverse=True)
    table = table[first]
    return Mesh(
        vertices=np.ascontiguousarray(table[:, :3]),
        normals=np.ascontiguousarray(table[:, 3:6]),
        faces=inverse.reshape(-1, 3).astype(np.uint32),
        uv=None if uv is None else np.ascontiguousarray(table[:, 6:8]),
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
    order = np.argsort(point, kind="stable")
    count = np.bincount(point)
    start = np.cumsum(count) - count
    repeats = count[point]
    corner = np.repeat(np.arange(len(repeats)), repeats)
    within = np.arange(len(corner)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    neighbour = order[start[point[corner]] + within]
    near = np.einsum("ij,ij->i", unit[corner // 3], unit[neighbour // 3]) > np.cos(crease)
    corner, neighbour = corner[near], neighbour[near]
    share = unit[neighbour // 3] * _angles(corners).ravel()[neighbour, None]
    total = np.stack([np.bincount(corner, share[:, k], minlength=len(repeats)) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.maximum(length, 1e-30), [0.0, 0.0, 1.0]).reshape(-1, 3, 3)


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
    _, point = np.unique((corners.reshape(-1, 3) / extent).round(6), axis=0, return_inverse=True)
    return point.reshape(-1, 3)


def is_closed(corners: np.ndarray) -> bool:
    """Whether triangles (m, 3, 3) enclose a volume, all seen counter-clockwise from outside.

    They do when every edge is run through once in each direction and the volume, the sum of the signed
    tetrahedra to the origin, is positive.
    """
    point = _points(corners)
    point = point[(point != np.roll(point, 1, axis=1)).all(axis=1)]  # slivers have no area to see
    there = np.vstack([point[:, [0, 1]], point[:, [1, 2]], point[:, [2, 0]]])
    once, count = np.unique(there, axis=0, return_counts=True)
    back = np.unique(there[:, ::-1], axis=0)
    volume = np.einsum("ij,ij->", corners[:, 0] - corners[0, 0], _areas(corners))
    return bool(count.max(initial=0) == 1 and np.array_equal(once, back) and volume > 0)


def _read_image(path: str) -> Optional[np.ndarray]:
    if not path:
        return None
    image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint8:
        raise ValueError(f"texture {path}: cannot be read as an 8-bit image")
    if image.ndim == 2:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB)
    return cv2.cvtColor(image, cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGB)


def _read_file(visual: Visual) -> Iterator[Mesh]:
    texture = _read_image(visual.texture)
    found = False
    for part in _parts(visual.file):
        found = True
        uv, rgba, own = _material(part)
        try:
            corners = _triangles(part) * np.asarray(visual.size)
        except IndexError:
            raise ValueError(f"mesh {visual.file}: a face names a vertex that there is not") from None
        if not np.isfinite(corners).all():
            raise ValueError(f"mesh {visual.file}: a vertex is not finite")
        if np.prod(visual.size) < 0:
            corners = corners[:, ::-1]  # a mirror image turns the faces inside out
            uv = None if uv is None else uv[:, ::-1]
        yield _assemble(corners, uv, rgba if texture is None else WHITE, own if texture is None else texture)
    if not found:
        raise ValueError(f"mesh {visual.file}: holds no triangles")


def _parts(path: str) -> Iterator[trimesh.Trimesh]:
    """The file's meshes, placed as its scene graph says."""
    try:
        loaded: Any = trimesh.load(path, process=False)
    except Exception as error:  # trimesh's readers raise whatever their parser raised
        raise ValueError(f"mesh {path}: cannot be read ({' '.join(str(error).split())})") from error
    if isinstance(loaded, trimesh.Trimesh):
        if len(loaded.faces):
            yield loaded
        return
    if not isinstance(loaded, trimesh.Scene):
        return  # points or lines: nothing that covers a pixel
    metres = trimesh.units.unit_conversion(loaded.units, "meters") if loaded.units else 1.0  # COLLADA has units
    for node in loaded.graph.nodes_geometry:
        transform, name = loaded.graph[node]
        part = loaded.geometry[name]
        if isinstance(part, trimesh.Trimesh) and len(part.faces):
            part = part.copy()
            part.apply_transform(transform)
            part.apply_scale(metres)
            yield part


def _material(part: Any) -> Tuple[Optional[np.ndarray], Tuple[float, float, float, float], Optional[np.ndarray]]:
    """Corner uv (m, 3, 2) or None, base colour and texture of a trimesh part, as far as it has them."""
    kind = getattr(part.visual, "kind", None)
    if kind in ("vertex", "face"):
        return None, _colour(part.visual.main_color), None
    if kind != "texture":
        return None, WHITE, None
    uv = part.visual.uv
    uv = None if uv is None else np.asarray(uv, dtype=np.float64)[np.asarray(part.faces)]
    material = part.visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if image is None or uv is None:
        return uv, _base_colour(material), None
    texture = np.array(image.convert("RGBA" if "A" in image.getbands() else "RGB"))
    return uv, _base_colour(material), texture


def _base_colour(material: Any) -> Tuple[float, float, float, float]:
    factor = getattr(material, "baseColorFactor", None)
    if factor is None:
        factor = getattr(material, "diffuse", None)
    if factor is None:
        return WHITE
    red, green, blue, alpha = _colour(factor)
    opacity = (getattr(material, "kwargs", None) or {}).get("d")  # MTL's dissolve; trimesh leaves it unread
    return (red, green, blue, float(opacity[0]) if opacity else alpha)


def _colour(values: Any) -> Tuple[float, float, float, float]:
    values = np.asarray(values)
    scaled = values / 255.0 if values.dtype == np.uint8 else values.astype(float)
    red, green, blue, alpha = (float(value) for value in scaled[:4])
    return (red, green, blue, alpha)
