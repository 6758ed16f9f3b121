"""An entry of another size: all its lengths so many times as large, and its mass with its volume."""

from __future__ import annotations

import math
from typing import Any

from drone_sim.config.errors import changed
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.curved_path import CurvedPathParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters, PartParameters

_LENGTHS = {  # of what is no shape
    "dummy": ("size",),
    "proximity_sensor": ("range", "offset", "radius"),
    "vision_sensor": ("near", "far", "size"),
}
_ROUND = ("cylinder", "capsule", "sphere")


def scaled(entry: EntryParameters, factors: Vector) -> EntryParameters:
    """Return an entry so many times as large along x, y and z. Raises ValueError for what cannot be."""
    if not all(math.isfinite(one) and one > 0 for one in factors):
        raise ValueError(
            f"'{entry.name}' is scaled by {', '.join(f'{one:g}' for one in factors)}: must be greater than 0"
        )
    values = _shape(entry, factors) if isinstance(entry, ObjectParameters) else _kind(entry, factors)
    checked = changed(entry, values)
    return entry.model_copy(update={key: getattr(checked, key) for key in values})


def _shape(entry: ObjectParameters, factors: Vector) -> dict[str, Any]:
    x, y, z = factors
    values: dict[str, Any] = {"mass": entry.mass * x * y * z} if entry.mass else {}
    if entry.inertia is not None:
        factor = _same(entry, factors, "with an `inertia`")
        moments = [factor**5 * one for one in entry.inertia.moments]
        values["inertia"] = {
            **entry.inertia.model_dump(),
            "moments": moments,
            "position": [factor * one for one in entry.inertia.position],
        }
    if isinstance(entry, CompoundParameters):
        factor = _same(entry, factors, "a compound")
        values["parts"] = [_part(part, factor) for part in entry.parts]
    else:
        values["size"] = _size(entry, factors)
    return values


def _part(part: PartParameters, factor: float) -> dict[str, Any]:
    place = [factor * one for one in part.position]
    return {**part.model_dump(), "position": place, "size": _size(part, (factor, factor, factor))}


def _size(said: ObjectParameters | PartParameters, factors: Vector) -> list[float]:
    x, y, z = factors
    size: tuple[float, ...] = getattr(said, "size", ())
    if said.shape not in _ROUND:
        if said.shape == "urdf":
            raise ValueError(f"'{getattr(said, 'name', '')}' is a urdf: change its size in the URDF file")
        return [factor * one for factor, one in zip(factors, size)]
    if x != y or (said.shape == "sphere" and x != z):
        raise ValueError(
            f"'{getattr(said, 'name', '')}' is a {said.shape}: it must stay round, not scaled by {x:g}, {y:g}, {z:g}"
        )
    return [x * size[0], *(z * one for one in size[1:])]


def _kind(entry: EntryParameters, factors: Vector) -> dict[str, Any]:
    kind = getattr(entry, "kind", "")
    if kind == "path":
        return {"points": [[a * b for a, b in zip(factors, one)] for one in getattr(entry, "points", ())]}
    if isinstance(entry, CurvedPathParameters):
        return _curved_path(entry, factors)
    if isinstance(entry, JointParameters):
        if entry.type != PRISMATIC:
            return {}
        ends = entry.limits and [factors[2] * one for one in entry.limits]
        return {"limits": ends, "value": factors[2] * entry.value}
    known = [key for key in _LENGTHS.get(kind, ()) if getattr(entry, key)]
    factor = _same(entry, factors, f"a {kind}") if known else 1.0
    return {key: factor * getattr(entry, key) for key in known}


def _curved_path(entry: CurvedPathParameters, factors: Vector) -> dict[str, Any]:
    mean = math.prod(factors) ** (1 / 3)  # as V-REP has it
    points = [
        {**one.model_dump(), "position": [a * b for a, b in zip(factors, one.position)]} for one in entry.control_points
    ]
    lengths = ("metres_per_radian", "metres_per_pause", "along")
    return {"control_points": points, **{key: mean * getattr(entry, key) for key in lengths}}


def _same(entry: EntryParameters, factors: Vector, what: str) -> float:
    if len({*factors}) > 1:
        x, y, z = factors
        raise ValueError(
            f"'{entry.name}', {what}, must be scaled by the same factor along x, y and z, not by {x:g}, {y:g}, {z:g}"
        )
    return factors[0]
