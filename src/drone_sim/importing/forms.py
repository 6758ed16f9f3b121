"""What a shape of a file is in a scene: simple forms where it is made of them, mesh files where not."""

from __future__ import annotations

from typing import Any

from drone_sim.importing.meshes import MeshWriter, Surface, TooLarge, color, has_triangles
from drone_sim.importing.numbers import numbers, pose_keys, shade
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.vrep_files.model import Mesh, Primitive, Shape

_THIN = 1e-3  # m, of what has no thickness
_SHORTEST = 1e-4  # m, of a length in a scene file
_MOST_PARTS = 64  # of a compound
_EQUAL = 1e-3  # two lengths that differ by less than this part of them


def form(name: str, shape: Shape, writer: MeshWriter, is_solid: bool) -> dict[str, Any] | None:
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


def _one(name: str, mesh: Mesh, simple: dict[str, Any] | None, writer: MeshWriter) -> dict[str, Any] | None:
    if simple is None:
        return _mesh(name, [(mesh, IDENTITY)], writer) if has_triangles(mesh) else None
    if "position" in simple or "rpy" in simple:  # a scene's shapes are centred on their frames
        return {"shape": "compound", "parts": [{**simple, "color": shade(mesh.color)}]}
    return {**simple, "color": shade(mesh.color)}


def _part(name: str, mesh: Mesh, simple: dict[str, Any] | None, writer: MeshWriter) -> dict[str, Any]:
    if simple is None:
        return _mesh(name, [(mesh, IDENTITY)], writer)
    return {**simple, "color": shade(mesh.color)}


def _mesh(name: str, surfaces: list[Surface], writer: MeshWriter) -> dict[str, Any]:
    if not surfaces:
        raise TooLarge("it has no triangles")
    keys: dict[str, Any] = {"shape": "mesh", "file": writer.write(name, surfaces)}
    own = color(surfaces)
    return keys if own is None else {**keys, "color": shade(own)}


def _simple(mesh: Mesh) -> dict[str, Any] | None:
    """Return shape, size and place of a simple form; None for what a scene file has no word for."""
    found = None if mesh.primitive is None else simple_size(mesh.primitive)
    if found is None or mesh.primitive is None:
        return None
    word, size = found
    return {"shape": word, "size": numbers(size), **pose_keys(mesh.primitive.pose.matrix)}


def simple_size(primitive: Primitive) -> tuple[str, tuple[float, ...]] | None:
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
