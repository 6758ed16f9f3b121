"""Paths of V-REP 3.x as entries of a scene file."""

from __future__ import annotations

from typing import Any

from drone_sim.importing.folder import Report, number, numbers
from drone_sim.mechanics.controlled_path import AUTOMATIC, COUNTS, METRES_PER_RADIAN, OWN, X_UP
from drone_sim.scene.kinds.curved_path import COUNTS as LEAST_AND_MOST
from drone_sim.scene.kinds.curved_path import FACTORS, LONGEST, MAX_LINE
from drone_sim.vrep_files import paths
from drone_sim.vrep_files.model import VrepControlPoint, VrepPath

_USUAL = {"factors": [0.5, 0.5], "count": 15, "pause": 0.0, "flags": 0, "channels": [0.0] * 4, "turn": [0, 0, 0, 1]}
_USUAL_COUNTS = "dl_if_nonzero"
_FARTHEST = 1e5  # m
_LEAST, _MOST = 1e-4, 1e3  # m, of what a turn or a pause counts for


def curved_path(name: str, path: VrepPath, report: Report) -> dict[str, Any]:
    """Return the keys of a path's entry, without its place; say what is not as it was."""
    there = [one for one in path.points if max(map(abs, one.pose.position)) < _FARTHEST]
    share = min(1.0, MAX_LINE / max(1, sum(one.count for one in there)))
    keys: dict[str, Any] = {"kind": "curved_path", "control_points": [_control_point(one, share) for one in there]}
    if path.switches & paths.CLOSED:
        keys["closed"] = True
    if path.switches & paths.FLAT:
        keys["flat"] = True
    usual = {"orientation": AUTOMATIC, "counts": _USUAL_COUNTS, "metres_per_radian": number(METRES_PER_RADIAN)}
    said = {
        "orientation": _orientation(path.switches),
        "counts": [*COUNTS][path.counts] if path.counts in range(len(COUNTS)) else _USUAL_COUNTS,
        "metres_per_radian": _within(number(path.metres_per_radian), _LEAST, _MOST),
        "metres_per_pause": _within(number(path.metres_per_pause), _LEAST, _MOST),
        "along": _within(number(path.along), 0.0, LONGEST),
    }
    keys.update(_unusual(said, {**usual, "metres_per_pause": 1.0, "along": 0.0}))
    if path.switches & paths.VELOCITY_PROFILE or any(one.speed != 1 for one in path.points):
        report.add(name, "a path: its velocity profile is not imported")
    broken = path.broken + len(path.points) - len(there)
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


def _control_point(one: VrepControlPoint, share: float) -> dict[str, Any]:
    said = {
        "turn": numbers(one.pose.orientation),
        "factors": [_within(number(factor), *FACTORS) for factor in (one.before, one.after)],
        "count": int(_within(one.count * share, *LEAST_AND_MOST)),
        "pause": _within(number(one.pause), 0.0, _MOST),
        "flags": one.flags,
        "channels": numbers(one.channels),
    }
    return {"position": numbers(one.pose.position), **_unusual(said, _USUAL)}


def _unusual(said: dict[str, Any], usual: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in said.items() if value != usual[key]}


def _within(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
