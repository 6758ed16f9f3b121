"""Mesh files for what is no simple form: OBJ, with a list of materials where there are several colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from drone_sim.files.mesh_files import MAX_PARTS, MAX_TRIANGLES
from drone_sim.importing.folder import Folder
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.vrep_files.model import Mesh, Rgba

MAX_SCENE_TRIANGLES = 450_000  # of all files that are written: a scene may have 500 000
Surface = tuple[Mesh, Matrix]  # and where it stands


class TooLarge(ValueError):
    """A mesh has more triangles than a file may have, or than a scene has left."""


class MeshWriter:
    """Writes mesh files, the same one for the same meshes, as long as there are triangles left."""

    def __init__(self, folder: Folder):
        """Take where they go."""
        self._folder = folder
        self._written: dict[int, str] = {}
        self._left = MAX_SCENE_TRIANGLES

    def write(self, name: str, surfaces: Sequence[Surface]) -> str:
        """Return the name of a file with these surfaces; their colours are in it where there are several.

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
            if len(materials) > 1:
                listed = file.removesuffix(".obj") + ".mtl"
                self._folder.write(listed, _mtl(materials))
                content = f"mtllib {listed.rpartition('/')[2]}\n{content}"
            self._folder.write(file, content)
            self._written[key] = file
        return self._written[key]


def color(surfaces: Sequence[Surface]) -> Rgba | None:
    """Return the one colour of some surfaces; None where they have several, which their file says."""
    colors = {mesh.color for mesh, _ in surfaces}
    return colors.pop() if len(colors) == 1 else None


def has_triangles(mesh: Mesh) -> bool:
    """Tell whether there is anything to see of a mesh."""
    return len(mesh.faces) > 0


def _materials(surfaces: Sequence[Surface]) -> dict[Rgba, str]:
    colors = dict.fromkeys(mesh.color for mesh, _ in surfaces)
    return {one: f"color_{number}" for number, one in enumerate(colors)}


def _obj(surfaces: Sequence[Surface], materials: dict[Rgba, str]) -> str:
    lines, first = [], 1
    for number, (rgba, material) in enumerate(materials.items()):
        if len(materials) > 1 and number < MAX_PARTS:  # what comes after the last one that may be is of its colour
            lines.append(f"usemtl {material}")
        for mesh, matrix in (one for one in surfaces if one[0].color == rgba):
            vertices = moved(mesh.vertices, matrix)
            lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in cast("list[list[float]]", vertices.tolist())]
            lines += [f"f {a} {b} {c}" for a, b, c in cast("list[list[int]]", (mesh.faces + first).tolist())]
            first += len(vertices)
    return "\n".join([*lines, ""])


def moved(vertices: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return vertices (n, 3) at a transform."""
    if matrix == IDENTITY:
        return vertices
    turn = np.array(matrix).reshape(3, 4)
    return vertices @ turn[:, :3].T + turn[:, 3]


def _mtl(materials: dict[Rgba, str]) -> str:
    lines = []
    for (red, green, blue, opacity), name in materials.items():
        lines += [f"newmtl {name}", f"Kd {red:.4g} {green:.4g} {blue:.4g}", f"d {opacity:.4g}"]
    return "\n".join([*lines, ""])
