"""Conversion of V-REP shapes: primitives where possible, mesh files otherwise.

Mesh files are OBJ, with an MTL file if there are textures or more than one colour.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from drone_sim.files import images
from drone_sim.files.mesh_files import MAX_PARTS, MAX_TRIANGLES
from drone_sim.importing.folder import Folder, numbers, pose_keys, shade
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.vrep_files.model import Rgba, VrepMesh, VrepPrimitive, VrepShape, VrepTexture

MAX_SCENE_TRIANGLES = 450_000  # in all written files; a scene is limited to 500 000
Surface = tuple[VrepMesh, Matrix]  # a mesh and its pose
_WHITE = (1.0, 1.0, 1.0)


class TooLarge(ValueError):
    """A mesh has more triangles than are allowed in a file, or than are left for the scene."""


class Look(NamedTuple):
    """A surface's material: its colour and texture."""

    color: Rgba
    texture: VrepTexture | None


class MeshWriter:
    """Writes mesh files, one for equal meshes, within the triangle limit of a scene."""

    def __init__(self, folder: Folder):
        """Write below `folder`."""
        self._folder = folder
        self._written: dict[int, str] = {}
        self._images: dict[VrepTexture, str] = {}
        self._triangles_left = MAX_SCENE_TRIANGLES

    def write(self, name: str, surfaces: Sequence[Surface]) -> str:
        """Write these surfaces to a mesh file, unless an equal one exists; return the file's name.

        The file refers to their textures, and to their colours if there is more than one. Raises TooLarge.
        """
        triangles = sum(len(mesh.faces) for mesh, _ in surfaces)
        if triangles > min(MAX_TRIANGLES, self._triangles_left):
            raise TooLarge(f"its {triangles} triangles are more than a scene can have")
        materials = _materials(surfaces)
        content = _obj(surfaces, materials)
        key = hash((content, tuple(materials.items())))
        self._triangles_left -= triangles
        if key not in self._written:
            file = self._folder.free_name(name, ".obj", "meshes/")
            if _need_mtl(materials):
                listed = file.removesuffix(".obj") + ".mtl"
                self._folder.write(listed, _mtl(materials, self._image))
                content = f"mtllib {listed.rpartition('/')[2]}\n{content}"
            self._folder.write(file, content)
            self._written[key] = file
        return self._written[key]

    def _image(self, texture: VrepTexture) -> str:
        """Write a texture, unless it is written already; return its file name, relative to the mesh files."""
        if texture not in self._images:
            name = self._folder.free_name(Path(texture.name).stem or "texture", ".png", "meshes/")
            self._folder.write(name, images.png(texture.image))
            self._images[texture] = name.rpartition("/")[2]
        return self._images[texture]


def color(surfaces: Sequence[Surface]) -> Rgba | None:
    """Return the colour that all surfaces share; None if the mesh file has materials (several colours, or textures)."""
    looks = _materials(surfaces)
    return None if _need_mtl(looks) else next(iter(looks)).color


def has_triangles(mesh: VrepMesh) -> bool:
    return len(mesh.faces) > 0


def _look(mesh: VrepMesh) -> Look:
    if mesh.cover is None:
        return Look(mesh.color, None)
    return Look((*_WHITE, mesh.color[3]) if mesh.cover.is_decal else mesh.color, mesh.cover.texture)


def _materials(surfaces: Sequence[Surface]) -> dict[Look, str]:
    looks = dict.fromkeys(_look(mesh) for mesh, _ in surfaces)
    return {look: f"color_{number}" for number, look in enumerate(looks)}


def _need_mtl(materials: Mapping[Look, str]) -> bool:
    return len(materials) > 1 or any(look.texture is not None for look in materials)


def _obj(surfaces: Sequence[Surface], materials: dict[Look, str]) -> str:
    lines, first, first_corner = [], 1, 1
    for number, (look, material) in enumerate(materials.items()):
        if _need_mtl(materials) and number < MAX_PARTS:  # further parts share the last allowed material
            lines.append(f"usemtl {material}")
        for mesh, matrix in (surface for surface in surfaces if _look(surface[0]) == look):
            vertices = moved(mesh.vertices, matrix)
            lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in cast("list[list[float]]", vertices.tolist())]
            lines += _faces(mesh, first, first_corner)
            first += len(vertices)
            first_corner += 3 * len(mesh.faces) if mesh.cover else 0
    return "\n".join([*lines, ""])


def _faces(mesh: VrepMesh, first: int, first_corner: int) -> list[str]:
    """Return the OBJ lines of a mesh's faces, with their texture coordinates if it has a texture."""
    faces = cast("list[list[int]]", (mesh.faces + first).tolist())
    if mesh.cover is None:
        return [f"f {a} {b} {c}" for a, b, c in faces]
    coordinates = cast("list[list[float]]", mesh.cover.corners.reshape(-1, 2).tolist())
    face_lines = (f"f {a}/{n} {b}/{n + 1} {c}/{n + 2}" for n, (a, b, c) in zip(itertools.count(first_corner, 3), faces))
    return [*(f"vt {u:.6g} {v:.6g}" for u, v in coordinates), *face_lines]


def moved(vertices: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return vertices (n, 3) transformed by `matrix`."""
    if matrix == IDENTITY:
        return vertices
    transform = np.array(matrix).reshape(3, 4)
    return vertices @ transform[:, :3].T + transform[:, 3]


def _mtl(materials: dict[Look, str], file_of: Callable[[VrepTexture], str]) -> str:
    lines = []
    for ((red, green, blue, opacity), texture), name in materials.items():
        lines += [f"newmtl {name}", f"Kd {red:.4g} {green:.4g} {blue:.4g}", f"d {opacity:.4g}"]
        lines += [f"map_Kd {file_of(texture)}"] if texture is not None else []
    return "\n".join([*lines, ""])


_THICKNESS = 1e-3  # m, of planes and discs
_MIN_LENGTH = 1e-4  # m, in a scene file
_MAX_COMPOUND_PARTS = 64  # of a compound
_EQUALITY = 1e-3  # relative difference below which lengths are equal


def form(name: str, shape: VrepShape, writer: MeshWriter, is_solid: bool) -> dict[str, Any] | None:
    """Return the keys of a shape in a scene file; None if it has no surface.

    `is_solid`: each of its meshes must be convex, because the dynamics moves it. Raises TooLarge.
    """
    meshes = [mesh for mesh in shape.meshes if has_triangles(mesh) or mesh.primitive is not None]
    simple = [_simple(mesh) for mesh in meshes]
    if not meshes:
        return None
    if len(meshes) == 1:
        return _single(name, meshes[0], simple[0], writer)
    if len(meshes) <= _MAX_COMPOUND_PARTS and (is_solid or all(simple)):
        return {"shape": "compound", "parts": [_part(name, *pair, writer) for pair in zip(meshes, simple)]}
    return _mesh(name, [(mesh, IDENTITY) for mesh in meshes if has_triangles(mesh)], writer)


def _single(name: str, mesh: VrepMesh, simple: dict[str, Any] | None, writer: MeshWriter) -> dict[str, Any] | None:
    if simple is None:
        return _mesh(name, [(mesh, IDENTITY)], writer) if has_triangles(mesh) else None
    if "position" in simple or "rpy" in simple:  # a scene's shapes are centred on their frames
        return {"shape": "compound", "parts": [{**simple, "color": shade(mesh.color)}]}
    return {**simple, "color": shade(mesh.color)}


def _part(name: str, mesh: VrepMesh, simple: dict[str, Any] | None, writer: MeshWriter) -> dict[str, Any]:
    if simple is None:
        return _mesh(name, [(mesh, IDENTITY)], writer)
    return {**simple, "color": shade(mesh.color)}


def _mesh(name: str, surfaces: list[Surface], writer: MeshWriter) -> dict[str, Any]:
    if not surfaces:
        raise TooLarge("it has no triangles")
    keys: dict[str, Any] = {"shape": "mesh", "file": writer.write(name, surfaces)}
    shared = color(surfaces)
    return keys if shared is None else {**keys, "color": shade(shared)}


def _simple(mesh: VrepMesh) -> dict[str, Any] | None:
    """Return the keys of a primitive; None if a scene file has no such shape."""
    simple = None if mesh.primitive is None else simple_size(mesh.primitive)
    if simple is None or mesh.primitive is None:
        return None
    word, size = simple
    return {"shape": word, "size": numbers(size), **pose_keys(mesh.primitive.pose.matrix)}


def simple_size(primitive: VrepPrimitive) -> tuple[str, tuple[float, ...]] | None:
    """Return the shape name and size (m) of a primitive in a scene file; None if there is no such shape there."""
    x, y, z = primitive.size
    word = primitive.word
    if word in ("plane", "disc"):
        z = _THICKNESS
    if min(x, y, z) < _MIN_LENGTH and word not in ("spheroid", "capsule"):
        x, y, z = (max(length, _MIN_LENGTH) for length in (x, y, z))
    if word in ("cuboid", "plane"):
        return "box", (x, y, z)
    is_round = abs(x - y) < _EQUALITY * max(x, y, _MIN_LENGTH)
    if word in ("cylinder", "disc") and is_round:
        return "cylinder", (x / 2, z)
    if word == "spheroid" and is_round and abs(x - z) < _EQUALITY * max(x, z, _MIN_LENGTH) and x > 2 * _MIN_LENGTH:
        return "sphere", (x / 2,)
    return None
