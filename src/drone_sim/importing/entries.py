"""Entries of `objects:` in a scene file, one for each imported V-REP object."""

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

_MAX_IMAGE_SIDE = 4096  # px
_MIN_LENGTH, _MAX_LENGTH = 1e-4, 1e5  # m
_MAX_FORCE = 1e9  # N m or N
_SUPPORTED_KINDS = {"force sensor": "force_sensor", "script": "script"}
_MIN_MASS, _MIN_MOMENT = 1e-6, 1e-12  # kg, kg m²
_MIN_FACTOR = 1e-6


class Entries:
    """Converts placed objects to scene entries, and reports what could not be converted exactly."""

    def __init__(self, writer: MeshWriter, report: Report):
        """Write meshes with `writer`; add differences to `report`."""
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

    def make(self, placed: Placed, parent: str, local: frames.Matrix) -> dict[str, Any]:
        """Return the entry of `placed`, a child of `parent` ('' for the world) at pose `local` in its frame."""
        kind_keys = self._readers.get(type(placed.object.of), self._other)(placed)
        keys: dict[str, Any] = {"name": placed.name}
        if placed.alias:
            keys["alias"] = placed.alias
        if placed.object.is_model:
            keys["model"] = True
        if parent:
            keys["parent"] = parent
        pose = pose_keys(local)
        return {**keys, **(kind_keys or {"kind": "dummy"}), "position": [0.0, 0.0, 0.0], **pose, **size_factor(placed)}

    def frame(self, placed: Placed, parent: str) -> dict[str, Any]:
        """Return a dummy entry on `parent` for an object whose shape is drawn as part of the parent."""
        alias = {"alias": placed.alias} if placed.alias else {}
        return {"name": placed.name, **alias, "parent": parent, "kind": "dummy", **size_factor(placed)}

    # ---- shapes

    def _shape(self, placed: Placed) -> dict[str, Any] | None:
        shape = placed.object.shape
        assert shape is not None  # for mypy: `_readers` ensures it
        moves = placed.is_dynamic and not _is_on_kinematic_joint(placed)
        if placed.is_dynamic and not moves:
            self._report.add(
                placed.name,
                "is the child of a joint that only scripts move: imported without mass, and moves with the joint",
            )
        try:
            keys = form(placed.name, shape, self._writer, is_solid=moves)
        except TooLarge as error:
            self._report.add(placed.name, f"only its pose is imported: {error}")
            return None
        if keys is None:
            self._report.add(placed.name, "only its pose is imported, because it has no surface")
            return None
        if moves:
            keys["mass"] = number(max(shape.mass, _MIN_MASS))
            keys.update(_inertia(shape.mass, shape.inertia))
        if not placed.is_respondable:
            keys["respondable"] = False
        if not placed.is_visible:
            keys["visible"] = False
        return keys

    # ---- others

    def _dummy(self, placed: Placed) -> dict[str, Any]:
        dummy = placed.object.of
        assert isinstance(dummy, VrepDummy)
        if len(dummy.path) > 1:
            points = {"kind": "path", "points": [numbers(point[:3]) for point in dummy.path]}
            lengths = [math.hypot(*point[3:]) for point in dummy.path]
            if min(lengths) < _MIN_LENGTH:
                return points
            turns = [numbers([value / length for value in point[3:]]) for point, length in zip(dummy.path, lengths)]
            return {**points, "turns": turns}
        if dummy.linked >= 0:
            self._report.add(placed.name, "its link to another dummy is not imported: it holds nothing together")
        return {"kind": "dummy", "size": number(dummy.size)} if dummy.size > 0 else {"kind": "dummy"}

    def _path(self, placed: Placed) -> dict[str, Any]:
        path = placed.object.of
        assert isinstance(path, VrepPath)
        return curved_path(placed.name, path, self._report)

    def _joint(self, placed: Placed) -> dict[str, Any]:
        joint = placed.object.of
        assert isinstance(joint, VrepJoint)
        if joint.kind == "screw":
            self._report.add(placed.name, "a screw joint is imported as a revolute joint: it turns without sliding")
        kind = "revolute" if joint.kind == "screw" else joint.kind
        keys: dict[str, Any] = {"kind": "joint", "type": kind}
        if joint.kind == "spherical":
            if abs(joint.turn.orientation[3]) < 1 - 1e-9:
                self._report.add(placed.name, "a spherical joint: its initial rotation is not imported")
            return keys
        if joint.limits is not None and joint.limits[0] < joint.limits[1]:
            keys["limits"] = numbers(joint.limits)
        low, high = joint.limits or (-math.inf, math.inf)
        keys["value"] = number(min(max(joint.position, low), high))
        if joint.mode == "kinematic":
            return keys
        keys["mode"] = joint.mode
        if joint.mode != "passive":
            keys.update(target=number(joint.target), max_force=number(min(joint.max_force, _MAX_FORCE)))
        return keys

    def _camera(self, placed: Placed) -> dict[str, Any]:
        camera = placed.object.of
        assert isinstance(camera, VrepCamera)
        if camera.resolution is None:
            return {"kind": "dummy"}
        width, height = (min(max(side, 1), _MAX_IMAGE_SIDE) for side in camera.resolution)
        keys: dict[str, Any] = {"kind": "vision_sensor", "width": width, "height": height}
        if camera.is_perspective:
            keys["fov"] = number(min(max(camera.angle, 0.01), 3.1))
        else:
            keys["size"] = number(max(camera.size, _MIN_LENGTH))
        near = min(max(camera.near, _MIN_LENGTH), _MAX_LENGTH / 2)
        return {**keys, "near": number(near), "far": number(min(max(camera.far, 2 * near), _MAX_LENGTH))}

    def _proximity_sensor(self, placed: Placed) -> dict[str, Any]:
        sensor = placed.object.of
        assert isinstance(sensor, VrepProximitySensor)
        keys: dict[str, Any] = {
            "kind": "proximity_sensor",
            "type": sensor.kind,
            "range": number(max(sensor.range, _MIN_LENGTH)),
            "offset": number(max(sensor.offset, 0.0)),
        }
        if sensor.kind == "cylinder":
            keys["radius"] = number(max(sensor.radius, _MIN_LENGTH))
        if sensor.kind in ("cone", "disc"):
            keys["angle"] = number(min(max(sensor.angle, 1e-3), math.tau))
        if sensor.kind == "pyramid":
            keys["angle"] = number(_opening_angle(sensor))
            self._report.add(placed.name, f"a pyramid: its sides open by {keys['angle']:.3g} rad all around")
        return keys

    def _other(self, placed: Placed) -> dict[str, Any]:
        kind = getattr(placed.object.of, "kind", "object")
        if kind not in (*_SUPPORTED_KINDS, "light"):
            self._report.add(placed.name, f"a {kind}: only its pose is imported")
        return {"kind": _SUPPORTED_KINDS.get(kind, "dummy")}


def size_factor(placed: Placed) -> dict[str, float]:
    """Return the key `size_factor` of an object that was scaled in V-REP, or {}; scripts may read it."""
    factor = number(placed.object.size_factor)
    return {"size_factor": factor} if factor != 1 and _MIN_FACTOR <= factor <= 1 / _MIN_FACTOR else {}


def _is_on_kinematic_joint(placed: Placed) -> bool:
    """Return whether a dynamic shape is a child of a joint that the dynamics does not move.

    Force sensors, and joints that the dynamics moves, hold only the shape directly below. Without a parent it is free.
    """
    joint = placed.above.object.of if placed.above is not None else None
    return isinstance(joint, VrepJoint) and (joint.mode == "kinematic" or joint.kind in ("spherical", "screw"))


def _inertia(mass: float, inertia: VrepInertia | None) -> dict[str, Any]:
    if inertia is None or min(inertia.moments) * mass < _MIN_MOMENT:
        return {}
    moments = [number(moment * mass, 15) for moment in inertia.moments]
    return {"inertia": {"moments": moments, **pose_keys(inertia.pose.matrix)}}


def _opening_angle(sensor: VrepProximitySensor) -> float:
    """Return the opening angle (rad) of a pyramid with its apex at the sensor and the same far width as `sensor`'s."""
    return min(max(2 * math.atan2(max(sensor.size) / 2, max(sensor.offset + sensor.range, _MIN_LENGTH)), 1e-3), 3.1)
