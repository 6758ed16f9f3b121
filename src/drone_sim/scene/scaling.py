"""Scaling of entries: lengths by the factors, mass with the volume."""

from __future__ import annotations

import math
from typing import Any

from drone_sim.config.errors import changed
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.joints import JointParameters
from drone_sim.scene.kinds.paths import CurvedPathParameters
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters, PartParameters

_LENGTHS = {  # of kinds that are not shapes
    "dummy": ("size",),
    "proximity_sensor": ("range", "offset", "radius"),
    "vision_sensor": ("near", "far", "size"),
}
_ROUND = ("cylinder", "capsule", "sphere")


def scaled(entry: EntryParameters, factors: Vector) -> EntryParameters:
    """Return an entry scaled by factors along x, y and z. Raises ValueError if it cannot be scaled so."""
    if not all(math.isfinite(factor) and factor > 0 for factor in factors):
        raise ValueError(
            f"'{entry.name}' is scaled by {', '.join(f'{factor:g}' for factor in factors)}: must be greater than 0"
        )
    values = _scaled_shape(entry, factors) if isinstance(entry, ObjectParameters) else _scaled_kind(entry, factors)
    checked = changed(entry, values)
    return entry.model_copy(update={key: getattr(checked, key) for key in values})


def _scaled_shape(entry: ObjectParameters, factors: Vector) -> dict[str, Any]:
    x, y, z = factors
    values: dict[str, Any] = {"mass": entry.mass * x * y * z} if entry.mass else {}
    if entry.inertia is not None:
        factor = _uniform(entry, factors, "with an `inertia`")
        moments = [factor**5 * moment for moment in entry.inertia.moments]
        values["inertia"] = {
            **entry.inertia.model_dump(),
            "moments": moments,
            "position": [factor * value for value in entry.inertia.position],
        }
    if isinstance(entry, CompoundParameters):
        factor = _uniform(entry, factors, "a compound")
        values["parts"] = [
            {
                **part.model_dump(),
                "position": [factor * value for value in part.position],
                "size": _scaled_size(part, (factor, factor, factor)),
            }
            for part in entry.parts
        ]
    else:
        values["size"] = _scaled_size(entry, factors)
    return values


def _scaled_size(shape: ObjectParameters | PartParameters, factors: Vector) -> list[float]:
    x, y, z = factors
    size: tuple[float, ...] = getattr(shape, "size", ())
    if shape.shape not in _ROUND:
        if shape.shape == "urdf":
            raise ValueError(f"'{getattr(shape, 'name', '')}' is a urdf: change its size in the URDF file")
        return [factor * length for factor, length in zip(factors, size)]
    if x != y or (shape.shape == "sphere" and x != z):
        raise ValueError(
            f"'{getattr(shape, 'name', '')}' is a {shape.shape}: it must stay round, not scaled by {x:g}, {y:g}, {z:g}"
        )
    return [x * size[0], *(z * length for length in size[1:])]


def _scaled_kind(entry: EntryParameters, factors: Vector) -> dict[str, Any]:
    kind = getattr(entry, "kind", "")
    if kind == "path":
        return {"points": [[a * b for a, b in zip(factors, point)] for point in getattr(entry, "points", ())]}
    if isinstance(entry, CurvedPathParameters):
        return _scaled_curved_path(entry, factors)
    if isinstance(entry, JointParameters):
        if entry.type != PRISMATIC:
            return {}
        limits = entry.limits and [factors[2] * limit for limit in entry.limits]
        return {"limits": limits, "value": factors[2] * entry.value}
    known = [key for key in _LENGTHS.get(kind, ()) if getattr(entry, key)]
    factor = _uniform(entry, factors, f"a {kind}") if known else 1.0
    return {key: factor * getattr(entry, key) for key in known}


def _scaled_curved_path(entry: CurvedPathParameters, factors: Vector) -> dict[str, Any]:
    mean = math.prod(factors) ** (1 / 3)  # as in V-REP
    points = [
        {**item.model_dump(), "position": [a * b for a, b in zip(factors, item.position)]}
        for item in entry.control_points
    ]
    lengths = ("metres_per_radian", "metres_per_pause", "along")
    return {"control_points": points, **{key: mean * getattr(entry, key) for key in lengths}}


def _uniform(entry: EntryParameters, factors: Vector, what: str) -> float:
    if len({*factors}) > 1:
        x, y, z = factors
        raise ValueError(
            f"'{entry.name}', {what}, must be scaled by the same factor along x, y and z, not by {x:g}, {y:g}, {z:g}"
        )
    return factors[0]
