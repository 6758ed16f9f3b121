"""Import of V-REP 3.x paths as scene entries."""

from __future__ import annotations

from typing import Any

from drone_sim.importing.folder import Report, number, numbers
from drone_sim.mechanics.controlled_path import AUTOMATIC, COUNTS, METRES_PER_RADIAN, OWN, X_UP
from drone_sim.scene.kinds.curved_path import COUNTS as COUNT_LIMITS
from drone_sim.scene.kinds.curved_path import FACTORS, LONGEST, MAX_LINE
from drone_sim.vrep_files import paths
from drone_sim.vrep_files.model import VrepControlPoint, VrepPath

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
