"""Entries of `objects:` in a scene file, one for each imported V-REP object."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from drone_sim.importing.folder import Report, label, number, numbers, pose_keys
from drone_sim.importing.placing import Placed
from drone_sim.importing.shapes import MeshWriter, TooLarge, form
from drone_sim.mechanics import frames
from drone_sim.mechanics.path import AUTOMATIC, COUNTS, METRES_PER_RADIAN, OWN, X_UP
from drone_sim.scene.kinds.paths import COUNTS as COUNT_LIMITS
from drone_sim.scene.kinds.paths import FACTORS, LONGEST, MAX_LINE
from drone_sim.vrep_files import paths
from drone_sim.vrep_files.model import (
    VrepCamera,
    VrepCollection,
    VrepControlPoint,
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
        return {"name": placed.name, **alias, "parent": parent, "kind": "dummy", "part": True, **size_factor(placed)}

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
        if dummy.linked >= 0 and not dummy.holds:
            self._report.add(placed.name, "its link to another dummy is not imported: only overlap constraints are")
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


_DEFAULTS = {"factors": [0.5, 0.5], "count": 15, "pause": 0.0, "flags": 0, "channels": [0.0] * 4, "turn": [0, 0, 0, 1]}
_DEFAULT_COUNTS = "dl_if_nonzero"
_MAX_COORDINATE = 1e5  # m
_MIN_EQUIVALENT, _MAX_EQUIVALENT = 1e-4, 1e3  # m, path length that a rotation or pause counts as


def curved_path(name: str, path: VrepPath, report: Report) -> dict[str, Any]:
    """Return the keys of a path's entry, without its pose; add differences to `report`."""
    points = [point for point in path.points if max(map(abs, point.pose.position)) < _MAX_COORDINATE]
    share = min(1.0, MAX_LINE / max(1, sum(point.count for point in points)))
    keys: dict[str, Any] = {"kind": "curved_path", "control_points": [_control_point(point, share) for point in points]}
    if path.switches & paths.CLOSED:
        keys["closed"] = True
    if path.switches & paths.FLAT:
        keys["flat"] = True
    defaults = {"orientation": AUTOMATIC, "counts": _DEFAULT_COUNTS, "metres_per_radian": number(METRES_PER_RADIAN)}
    values = {
        "orientation": _orientation(path.switches),
        "counts": [*COUNTS][path.counts] if path.counts in range(len(COUNTS)) else _DEFAULT_COUNTS,
        "metres_per_radian": _clamped(number(path.metres_per_radian), _MIN_EQUIVALENT, _MAX_EQUIVALENT),
        "metres_per_pause": _clamped(number(path.metres_per_pause), _MIN_EQUIVALENT, _MAX_EQUIVALENT),
        "along": _clamped(number(path.along), 0.0, LONGEST),
    }
    keys.update(_without_defaults(values, {**defaults, "metres_per_pause": 1.0, "along": 0.0}))
    if path.switches & paths.VELOCITY_PROFILE or any(point.speed != 1 for point in path.points):
        report.add(name, "a path: its velocity profile is not imported")
    broken = path.broken + len(path.points) - len(points)
    if broken:
        report.add(name, f"a path: {broken} of its control points are not finite: left out")
    if share < 1:
        report.add(name, f"a path: its curves are drawn with fewer points, because a path has {MAX_LINE} at most")
    if path.has_surface:
        report.add(name, "a path: the surface along it is not imported")
    return keys


def _orientation(switches: int) -> str:
    if not switches & paths.AUTOMATIC:
        return OWN
    return X_UP if switches & paths.X_UP else AUTOMATIC


def _control_point(point: VrepControlPoint, share: float) -> dict[str, Any]:
    values = {
        "turn": numbers(point.pose.orientation),
        "factors": [_clamped(number(factor), *FACTORS) for factor in (point.before, point.after)],
        "count": int(_clamped(point.count * share, *COUNT_LIMITS)),
        "pause": _clamped(number(point.pause), 0.0, _MAX_EQUIVALENT),
        "flags": point.flags,
        "channels": numbers(point.channels),
    }
    return {"position": numbers(point.pose.position), **_without_defaults(values, _DEFAULTS)}


def _without_defaults(values: dict[str, Any], defaults: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value != defaults[key]}


def _clamped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def collection_entries(
    collections: Sequence[VrepCollection], names: Mapping[int, str], report: Report
) -> Iterator[dict[str, Any]]:
    """Yield the entries of `collections:`; `names` maps handles of imported objects to their names."""
    used: set[str] = set()
    for collection in collections:
        name = label(collection.name)
        if not name or name in used:  # created by V-REP's editor; no script finds it by name
            continue
        used.add(name)
        items: list[dict[str, Any]] = []
        for item in collection.items:
            if item.what != "all" and item.object not in names:
                report.add(collection.name, "a collection: some of its objects are not imported")
                continue
            target = {"what": item.what, "object": names.get(item.object, "")}
            flags = {"removes": item.removes, "without": item.without}
            items.append({key: value for key, value in {**target, **flags}.items() if value})
        yield {"name": name, "items": items}
