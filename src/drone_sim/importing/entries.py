"""What the objects of a file are in a scene: one entry of `objects:` each."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from drone_sim.importing.folder import Report, number, numbers, pose_keys
from drone_sim.importing.paths import curved_path
from drone_sim.importing.placing import Placed
from drone_sim.importing.shapes import MeshWriter, TooLarge, form
from drone_sim.mechanics import frames
from drone_sim.vrep_files.model import (
    VrepCamera,
    VrepDummy,
    VrepInertia,
    VrepJoint,
    VrepPath,
    VrepProximitySensor,
    VrepShape,
)

_LARGEST_PICTURE = 4096  # px, of a side
_NEAREST, _FARTHEST = 1e-4, 1e5  # m
_LARGEST_FORCE = 1e9  # N m or N
_WITHOUT_LOSS = {"force sensor": "force_sensor", "script": "script"}
_LEAST_MASS, _LEAST_MOMENT = 1e-6, 1e-12
_LEAST_FACTOR = 1e-6


class Entries:
    """Makes an entry of every object, and says what is not as it was."""

    def __init__(self, writer: MeshWriter, report: Report):
        """Take what writes mesh files, and what is told of the rest."""
        self._writer = writer
        self._report = report
        self._readers: dict[type, Callable[[Placed], dict[str, Any] | None]] = {
            VrepShape: self._shape,
            VrepDummy: self._dummy,
            VrepPath: self._path,
            VrepJoint: self._joint,
            VrepCamera: self._camera,
            VrepProximitySensor: self._proximity_sensor,
        }

    def make(self, one: Placed, parent: str, local: frames.Matrix) -> dict[str, Any]:
        """Return the entry of an object that hangs on `parent` ('' the world) at `local` in its frame."""
        own = self._readers.get(type(one.object.of), self._other)(one)
        keys: dict[str, Any] = {"name": one.name}
        if one.alias:
            keys["alias"] = one.alias
        if one.object.is_model:
            keys["model"] = True
        if parent:
            keys["parent"] = parent
        place = pose_keys(local)
        return {**keys, **(own or {"kind": "dummy"}), "position": [0.0, 0.0, 0.0], **place, **size_factor(one)}

    def frame(self, one: Placed, parent: str) -> dict[str, Any]:
        """Return an entry that is only a place on `parent`, for what is seen as a part of that."""
        alias = {"alias": one.alias} if one.alias else {}
        return {"name": one.name, **alias, "parent": parent, "kind": "dummy", **size_factor(one)}

    # ---- shapes

    def _shape(self, one: Placed) -> dict[str, Any] | None:
        shape = one.object.shape
        assert shape is not None  # for mypy: the table says so
        moves = one.is_dynamic and not _is_only_carried(one)
        if one.is_dynamic and not moves:
            self._report.add(
                one.name,
                "is the child of a joint that only scripts move: imported without mass, and moves with the joint",
            )
        try:
            keys = form(one.name, shape, self._writer, is_solid=moves)
        except TooLarge as error:
            self._report.add(one.name, f"only its pose is imported: {error}")
            return None
        if keys is None:
            self._report.add(one.name, "only its pose is imported, because it has no surface")
            return None
        if moves:
            keys["mass"] = number(max(shape.mass, _LEAST_MASS))
            keys.update(_inertia(shape.mass, shape.inertia))
        if not one.is_respondable:
            keys["respondable"] = False
        if not one.is_visible:
            keys["visible"] = False
        return keys

    # ---- others

    def _dummy(self, one: Placed) -> dict[str, Any]:
        of = one.object.of
        assert isinstance(of, VrepDummy)
        if len(of.path) > 1:
            points = {"kind": "path", "points": [numbers(point[:3]) for point in of.path]}
            lengths = [math.hypot(*point[3:]) for point in of.path]
            if min(lengths) < _NEAREST:
                return points
            turns = [numbers([one / length for one in point[3:]]) for point, length in zip(of.path, lengths)]
            return {**points, "turns": turns}
        if of.linked >= 0:
            self._report.add(one.name, "its link to another dummy is not imported: it holds nothing together")
        return {"kind": "dummy", "size": number(of.size)} if of.size > 0 else {"kind": "dummy"}

    def _path(self, one: Placed) -> dict[str, Any]:
        path = one.object.of
        assert isinstance(path, VrepPath)
        return curved_path(one.name, path, self._report)

    def _joint(self, one: Placed) -> dict[str, Any]:
        joint = one.object.of
        assert isinstance(joint, VrepJoint)
        if joint.kind == "screw":
            self._report.add(one.name, "a screw joint is imported as a revolute joint: it turns without sliding")
        kind = "revolute" if joint.kind == "screw" else joint.kind
        keys: dict[str, Any] = {"kind": "joint", "type": kind}
        if joint.kind == "spherical":
            if abs(joint.turn.orientation[3]) < 1 - 1e-9:
                self._report.add(one.name, "a spherical joint: its initial rotation is not imported")
            return keys
        if joint.limits is not None and joint.limits[0] < joint.limits[1]:
            keys["limits"] = numbers(joint.limits)
        low, high = joint.limits or (-math.inf, math.inf)
        keys["value"] = number(min(max(joint.position, low), high))
        if joint.mode == "kinematic":
            return keys
        keys["mode"] = joint.mode
        if joint.mode != "passive":
            keys.update(target=number(joint.target), max_force=number(min(joint.max_force, _LARGEST_FORCE)))
        return keys

    def _camera(self, one: Placed) -> dict[str, Any]:
        camera = one.object.of
        assert isinstance(camera, VrepCamera)
        if camera.resolution is None:
            return {"kind": "dummy"}
        width, height = (min(max(side, 1), _LARGEST_PICTURE) for side in camera.resolution)
        keys: dict[str, Any] = {"kind": "vision_sensor", "width": width, "height": height}
        if camera.is_perspective:
            keys["fov"] = number(min(max(camera.angle, 0.01), 3.1))
        else:
            keys["size"] = number(max(camera.size, _NEAREST))
        near = min(max(camera.near, _NEAREST), _FARTHEST / 2)
        return {**keys, "near": number(near), "far": number(min(max(camera.far, 2 * near), _FARTHEST))}

    def _proximity_sensor(self, one: Placed) -> dict[str, Any]:
        sensor = one.object.of
        assert isinstance(sensor, VrepProximitySensor)
        keys: dict[str, Any] = {
            "kind": "proximity_sensor",
            "type": sensor.kind,
            "range": number(max(sensor.range, _NEAREST)),
            "offset": number(max(sensor.offset, 0.0)),
        }
        if sensor.kind == "cylinder":
            keys["radius"] = number(max(sensor.radius, _NEAREST))
        if sensor.kind in ("cone", "disc"):
            keys["angle"] = number(min(max(sensor.angle, 1e-3), math.tau))
        if sensor.kind == "pyramid":
            keys["angle"] = number(_opening(sensor))
            self._report.add(one.name, f"a pyramid: its sides open by {keys['angle']:.3g} rad all around")
        return keys

    def _other(self, one: Placed) -> dict[str, Any]:
        kind = getattr(one.object.of, "kind", "object")
        if kind not in (*_WITHOUT_LOSS, "light"):
            self._report.add(one.name, f"a {kind}: only its pose is imported")
        return {"kind": _WITHOUT_LOSS.get(kind, "dummy")}


def size_factor(one: Placed) -> dict[str, float]:
    """Return the key `size_factor` of an object that was scaled in V-REP, for scripts that ask for it."""
    factor = number(one.object.size_factor)
    return {"size_factor": factor} if factor != 1 and _LEAST_FACTOR <= factor <= 1 / _LEAST_FACTOR else {}


def _is_only_carried(one: Placed) -> bool:
    """Tell whether a dynamic shape hangs on a joint that the dynamics does not move.

    Joints that it moves, and force sensors, hold the one shape right below them. A shape without a parent is free.
    """
    joint = one.above.object.of if one.above is not None else None
    return isinstance(joint, VrepJoint) and (joint.mode == "kinematic" or joint.kind in ("spherical", "screw"))


def _inertia(mass: float, inertia: VrepInertia | None) -> dict[str, Any]:
    if inertia is None or min(inertia.moments) * mass < _LEAST_MOMENT:
        return {}
    moments = [number(moment * mass, 15) for moment in inertia.moments]
    return {"inertia": {"moments": moments, **pose_keys(inertia.pose.matrix)}}


def _opening(sensor: VrepProximitySensor) -> float:
    """Return the angle (rad) at which a pyramid would end as wide as this one, which begins with some width."""
    return min(max(2 * math.atan2(max(sensor.size) / 2, max(sensor.offset + sensor.range, _NEAREST)), 1e-3), 3.1)
