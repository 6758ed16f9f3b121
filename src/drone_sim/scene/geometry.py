"""Geometry of entries: scaling (lengths by the factors, mass with the volume), compounds, bounding boxes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from drone_sim.config.errors import changed
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.scene.entry import EntryParameters, pose_keys
from drone_sim.scene.kinds.joints import JointParameters
from drone_sim.scene.kinds.paths import CurvedPathParameters
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters, PartParameters
from drone_sim.shapes import SCENE_SHAPES
from drone_sim.shapes.compound import parts_of
from drone_sim.shapes.shape import DrawnShape

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


# ---- compounds


def grouped(entries: Sequence[EntryParameters], frames_of: Sequence[Matrix]) -> dict[str, Any]:
    """Return the entry of a compound of several shapes, in the frame of the first. Raises ValueError."""
    parts, mass = [], 0.0
    for entry, matrix in zip(entries, frames_of):
        if not isinstance(entry, ObjectParameters) or entry.shape == "urdf":
            raise ValueError(f"'{entry.name}' is not a shape that can be grouped")
        local = frames.relative(frames_of[0], matrix)
        members = entry.parts if isinstance(entry, CompoundParameters) else [entry]
        for member in members:
            pose = local if member is entry else frames.multiply(local, frames.from_rpy(member.position, member.rpy))
            parts.append({**_shape_keys(member), **pose_keys(pose)})
        mass += entry.mass
    first = entries[0]
    assert isinstance(first, ObjectParameters), "checked above"
    common = {
        key: getattr(first, key) for key in ("parent", "position", "rpy", "alias", "static", "respondable", "visible")
    }
    return {**common, "shape": "compound", "mass": mass, "parts": parts}


def parted(entry: EntryParameters, matrix: Matrix) -> list[dict[str, Any]]:
    """Return the entries of the parts of a compound, each without a parent. Raises ValueError."""
    if not isinstance(entry, CompoundParameters):
        raise ValueError(f"'{entry.name}' is not a compound")
    volumes = [_volume(part) for part in entry.parts]
    common = {key: getattr(entry, key) for key in ("static", "respondable", "visible")}
    return [
        {
            **common,
            **_shape_keys(part),
            **pose_keys(frames.multiply(matrix, frames.from_rpy(part.position, part.rpy))),
            "mass": entry.mass * volume / sum(volumes),
        }
        for part, volume in zip(entry.parts, volumes)
    ]


def _shape_keys(parameters: ObjectParameters | PartParameters) -> dict[str, Any]:
    keys = [field.name for field in fields(SCENE_SHAPES[parameters.shape])]
    return {"shape": parameters.shape, "color": parameters.color, **{key: getattr(parameters, key) for key in keys}}


def _volume(part: PartParameters) -> float:
    shape = part.part.shape
    return shape.solid().volume if isinstance(shape, DrawnShape) else 0.0


def bounds(entry: EntryParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return the minimum and maximum corner (m) of a shape in its own frame. Raises ValueError if it is not a shape."""
    if not isinstance(entry, ObjectParameters) or entry.shape == "urdf":
        raise ValueError(f"'{entry.name}' has no bounding box of its own")
    corners = []
    for shape, local, _ in parts_of(entry.to_shape(), entry.color):
        assert isinstance(shape, DrawnShape), "every shape except a urdf is drawn"
        transform = np.reshape(local, (3, 4))
        for part in shape.triangles():
            corners.append(part.corners.reshape(-1, 3) @ transform[:, :3].T + transform[:, 3])
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)
