"""What a shape of a file is in a scene: a simple form where it is made of such, a mesh file where not.

Mesh files are OBJ, with a list of materials where there are several colours, or textures.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from drone_sim.files import images
from drone_sim.files.mesh_part import MAX_PARTS, MAX_TRIANGLES
from drone_sim.importing.folder import Folder, numbers, pose_keys, shade
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.vrep_files.model import Rgba, VrepMesh, VrepPrimitive, VrepShape, VrepTexture

MAX_SCENE_TRIANGLES = 450_000  # of all files that are written: a scene may have 500 000
Surface = tuple[VrepMesh, Matrix]  # and where it stands
_WHITE = (1.0, 1.0, 1.0)


class TooLarge(ValueError):
    """A mesh has more triangles than a file may have, or than a scene has left."""


class Look(NamedTuple):
    """How a surface looks: its colour, and the texture on it."""

    color: Rgba
    texture: VrepTexture | None


class MeshWriter:
    """Writes mesh files, the same one for the same meshes, as long as there are triangles left."""

    def __init__(self, folder: Folder):
        """Take where they go."""
        self._folder = folder
        self._written: dict[int, str] = {}
        self._images: dict[VrepTexture, str] = {}
        self._left = MAX_SCENE_TRIANGLES

    def write(self, name: str, surfaces: Sequence[Surface]) -> str:
        """Return the name of a file with these surfaces; it has their textures, and their colours if several.

        Raises TooLarge.
        """
        triangles = sum(len(mesh.faces) for mesh, _ in surfaces)
        if triangles > min(MAX_TRIANGLES, self._left):
            raise TooLarge(f"its {triangles} triangles are more than a scene can have")
        materials = _materials(surfaces)
        content = _obj(surfaces, materials)
        key = hash((content, tuple(materials.items())))
        self._left -= triangles
        if key not in self._written:
            file = self._folder.free_name(name, ".obj", "meshes/")
            if _are_listed(materials):
                listed = file.removesuffix(".obj") + ".mtl"
                self._folder.write(listed, _mtl(materials, self._image))
                content = f"mtllib {listed.rpartition('/')[2]}\n{content}"
            self._folder.write(file, content)
            self._written[key] = file
        return self._written[key]

    def _image(self, texture: VrepTexture) -> str:
        """Return the name of a texture's file, beside the mesh files."""
        if texture not in self._images:
            name = self._folder.free_name(Path(texture.name).stem or "texture", ".png", "meshes/")
            self._folder.write(name, images.png(texture.image))
            self._images[texture] = name.rpartition("/")[2]
        return self._images[texture]


def color(surfaces: Sequence[Surface]) -> Rgba | None:
    """Return the one colour of some surfaces; None where they have several, or textures, which their file says."""
    looks = _materials(surfaces)
    return None if _are_listed(looks) else next(iter(looks)).color


def has_triangles(mesh: VrepMesh) -> bool:
    """Tell whether there is anything to see of a mesh."""
    return len(mesh.faces) > 0


def _look(mesh: VrepMesh) -> Look:
    if mesh.cover is None:
        return Look(mesh.color, None)
    return Look((*_WHITE, mesh.color[3]) if mesh.cover.is_decal else mesh.color, mesh.cover.texture)


def _materials(surfaces: Sequence[Surface]) -> dict[Look, str]:
    looks = dict.fromkeys(_look(mesh) for mesh, _ in surfaces)
    return {one: f"color_{number}" for number, one in enumerate(looks)}


def _are_listed(materials: Mapping[Look, str]) -> bool:
    return len(materials) > 1 or any(one.texture is not None for one in materials)


def _obj(surfaces: Sequence[Surface], materials: dict[Look, str]) -> str:
    lines, first, first_corner = [], 1, 1
    for number, (look, material) in enumerate(materials.items()):
        if _are_listed(materials) and number < MAX_PARTS:  # what comes after the last one that may be looks like it
            lines.append(f"usemtl {material}")
        for mesh, matrix in (one for one in surfaces if _look(one[0]) == look):
            vertices = moved(mesh.vertices, matrix)
            lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in cast("list[list[float]]", vertices.tolist())]
            lines += _faces(mesh, first, first_corner)
            first += len(vertices)
            first_corner += 3 * len(mesh.faces) if mesh.cover else 0
    return "\n".join([*lines, ""])


def _faces(mesh: VrepMesh, first: int, first_corner: int) -> list[str]:
    """Return the lines of a mesh's faces, with where their corners lie on its texture."""
    faces = cast("list[list[int]]", (mesh.faces + first).tolist())
    if mesh.cover is None:
        return [f"f {a} {b} {c}" for a, b, c in faces]
    on_texture = cast("list[list[float]]", mesh.cover.corners.reshape(-1, 2).tolist())
    covered = (f"f {a}/{n} {b}/{n + 1} {c}/{n + 2}" for n, (a, b, c) in zip(itertools.count(first_corner, 3), faces))
    return [*(f"vt {u:.6g} {v:.6g}" for u, v in on_texture), *covered]


def moved(vertices: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return vertices (n, 3) at a transform."""
    if matrix == IDENTITY:
        return vertices
    turn = np.array(matrix).reshape(3, 4)
    return vertices @ turn[:, :3].T + turn[:, 3]


def _mtl(materials: dict[Look, str], file_of: Callable[[VrepTexture], str]) -> str:
    lines = []
    for ((red, green, blue, opacity), texture), name in materials.items():
        lines += [f"newmtl {name}", f"Kd {red:.4g} {green:.4g} {blue:.4g}", f"d {opacity:.4g}"]
        lines += [f"map_Kd {file_of(texture)}"] if texture is not None else []
    return "\n".join([*lines, ""])


_THIN = 1e-3  # m, of what has no thickness
_SHORTEST = 1e-4  # m, of a length in a scene file
_MOST_PARTS = 64  # of a compound
_EQUAL = 1e-3  # two lengths that differ by less than this part of them


def form(name: str, shape: VrepShape, writer: MeshWriter, is_solid: bool) -> dict[str, Any] | None:
    """Return the keys of a shape in a scene file; None where there is nothing of it.

    `is_solid`: it is convex in each of its meshes, as what the dynamics moves has to be. Raises TooLarge.
    """
    meshes = [mesh for mesh in shape.meshes if has_triangles(mesh) or mesh.primitive is not None]
    simple = [_simple(mesh) for mesh in meshes]
    if not meshes:
        return None
    if len(meshes) == 1:
        return _one(name, meshes[0], simple[0], writer)
    if len(meshes) <= _MOST_PARTS and (is_solid or all(simple)):
        return {"shape": "compound", "parts": [_part(name, *pair, writer) for pair in zip(meshes, simple)]}
    return _mesh(name, [(mesh, IDENTITY) for mesh in meshes if has_triangles(mesh)], writer)


def _one(name: str, mesh: VrepMesh, simple: dict[str, Any] | None, writer: MeshWriter) -> dict[str, Any] | None:
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
    own = color(surfaces)
    return keys if own is None else {**keys, "color": shade(own)}


def _simple(mesh: VrepMesh) -> dict[str, Any] | None:
    """Return shape, size and place of a simple form; None for what a scene file has no word for."""
    found = None if mesh.primitive is None else simple_size(mesh.primitive)
    if found is None or mesh.primitive is None:
        return None
    word, size = found
    return {"shape": word, "size": numbers(size), **pose_keys(mesh.primitive.pose.matrix)}


def simple_size(primitive: VrepPrimitive) -> tuple[str, tuple[float, ...]] | None:
    """Return the word and the size (m) of a form in a scene file; None for what that has no word for."""
    x, y, z = primitive.size
    word = primitive.word
    if word in ("plane", "disc"):
        z = _THIN
    if min(x, y, z) < _SHORTEST and word not in ("spheroid", "capsule"):
        x, y, z = (max(length, _SHORTEST) for length in (x, y, z))
    if word in ("cuboid", "plane"):
        return "box", (x, y, z)
    round_ = abs(x - y) < _EQUAL * max(x, y, _SHORTEST)
    if word in ("cylinder", "disc") and round_:
        return "cylinder", (x / 2, z)
    if word == "spheroid" and round_ and abs(x - z) < _EQUAL * max(x, z, _SHORTEST) and x > 2 * _SHORTEST:
        return "sphere", (x / 2,)
    return None
