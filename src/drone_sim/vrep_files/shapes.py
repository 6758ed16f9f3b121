"""Shapes: one mesh, or a compound of meshes and compounds, with mass and inertia."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import Level, levels
from drone_sim.vrep_files.errors import VrepFileError
from drone_sim.vrep_files.meshes import Pools, read_mesh
from drone_sim.vrep_files.model import Inertia, Mesh, Shape
from drone_sim.vrep_files.poses import position_first

_DEEPEST = 16  # compounds within compounds
_MOST_MESHES = 20_000  # of a shape
_MESHES, _COMPOUNDS = ("Gst", "Geo"), ("Gsg", "Wrp")
_NOT_STATIC, _RESPONDABLE = 0x80, 0x01


def read_shape(own: Level, pools: Pools) -> Shape:
    """Return a shape from its class level. Raises VrepFileError."""
    mass, inertia, meshes = 1.0, None, []
    data = own.find("Ge2")
    for chunk in levels(data, 2)[0].chunks if data is not None else ():
        if chunk.tag in (*_MESHES, *_COMPOUNDS):
            wrapper = levels(chunk.data, 3)[0]
            mass, inertia = _mass(wrapper), _inertia(wrapper)
            meshes += _meshes(chunk.tag, chunk.data, pools, 0)
    return Shape(
        meshes=tuple(meshes),
        mass=mass,
        inertia=inertia,
        is_dynamic=bool(own.bits("Sss") & _NOT_STATIC),
        is_respondable=bool(own.bits("Ss3", "Ss2") & _RESPONDABLE),
    )


def _meshes(tag: str, data: bytes, pools: Pools, depth: int) -> list[Mesh]:
    if depth > _DEEPEST:
        raise VrepFileError(f"compounds within compounds, deeper than {_DEEPEST}")
    found = levels(data, 3)
    if tag in _MESHES:
        return [read_mesh(found[0], found[1] if len(found) > 1 else Level(), pools)]
    meshes: list[Mesh] = []
    for part in (part for one in found for part in one.chunks if part.tag in (*_MESHES, *_COMPOUNDS)):
        meshes += _meshes(part.tag, part.data, pools, depth + 1)
        if len(meshes) > _MOST_MESHES:
            raise VrepFileError(f"a compound of more than {_MOST_MESHES} meshes")
    return meshes


def _mass(wrapper: Level) -> float:
    mass = wrapper.numbers("_as", "Mas", 1)
    return 1.0 if mass is None else max(0.0, mass[0])


def _inertia(wrapper: Level) -> Inertia | None:
    numbers = wrapper.numbers("_ne", "Ine", 10)
    if numbers is None:
        return None
    a, b, c = (max(0.0, value) for value in numbers[7:])
    return Inertia(position_first(numbers[:7], "_ne"), (a, b, c))
