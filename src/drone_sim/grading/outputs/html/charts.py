"""Charts of a result card, in pixels (what was flown beside what a criterion allows), and the scene that they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drone_sim.grading.criteria.columns import Attitude, Overshoot, Stays, SteadyError, StepCriterion
from drone_sim.grading.criteria.contacts import Landed
from drone_sim.grading.criteria.criterion import Criterion
from drone_sim.grading.criteria.distances import Drift, PathFollowing, Reach
from drone_sim.grading.flight_record import UNITS
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.shapes.compound import Part, parts_of
from drone_sim.shapes.shape import DrawnShape

WIDTH, HEIGHT = 320, 150  # px, of a chart over time
SIDE = 240  # px, of a chart from above
_LEFT, _BOTTOM, _TOP = 40, 18, 6  # px, for the numbers
_ROOM = 0.12  # of the range, free at both ends
_SMALLEST = 0.5  # m, half of a side from above
_MAX_POINTS = 400  # of a curve
_BASE = (0, 1, 3, 2)  # corners of a box's lower side, see scene_of
_DEFAULT_SIDE = 0.2  # m, of the box of a shape that only PyBullet can measure
_MAX_DEPTH = 32  # parents of an object that are followed
_DIGITS = 4

Columns = Mapping[str, np.ndarray]
Point = tuple[float, float]


@dataclass(frozen=True)
class Chart:
    """A drawing: the flown curve over what is allowed. All coordinates are in px."""

    title: str
    width: int
    height: int
    flown: str  # the curve's points, as SVG writes them
    failed: Point | None  # the moment that decided, if it failed
    bands: Sequence[tuple[float, float]] = ()  # top and height of an allowed range, over the whole width
    lines: Sequence[float] = ()  # heights of targets
    circles: Sequence[tuple[float, float, float]] = ()  # center and radius of an allowed place
    corridor: tuple[str, float] = ("", 0.0)  # points and width of an allowed way
    objects: Sequence[tuple[str, str]] = ()  # points and color of the scene's objects
    labels: Sequence[tuple[float, float, str, str]] = ()  # x, y, text-anchor, text


def chart_of(criterion: Criterion, columns: Columns, scene: Mapping[str, Any], at: float | None) -> Chart | None:
    """Return the chart of a criterion, None if a drawing says nothing about it.

    `scene` is as in scene_of; the criterion failed at the time `at` (s), None if it passed.
    """
    bounds = _bounds_of(criterion, columns)
    if bounds is not None:
        return _over_time(bounds, criterion, columns, at)
    ground = _ground_of(criterion, columns, scene)
    return None if ground is None else _from_above(ground, columns, scene, at)


class Bounds(NamedTuple):
    """What is allowed of a column; a bound that is None is open."""

    of: str
    low: float | None
    high: float | None
    target: float | None = None


class Ground(NamedTuple):
    """What is allowed, as seen from above, in m."""

    circles: Sequence[tuple[float, float, float]]  # center and radius
    corridor: Sequence[Point] = ()
    width: float = 0.0  # of the corridor


def _bounds_of(criterion: Criterion, columns: Columns) -> Bounds | None:
    match criterion:
        case Drift(axes=("x" | "y" | "z") as axis, at_most=most):
            origin = _origin(criterion, columns)["xyz".index(axis)]
            bounds = Bounds(axis, origin - most, origin + most)
        case Stays():
            bounds = Bounds(criterion.of, criterion.at_least, criterion.at_most)
        case Attitude():
            bounds = Bounds("tilt", 0.0, criterion.at_most)
        case SteadyError(to=target, at_most=most):
            bounds = Bounds(criterion.of, target - most, target + most, target)
        case Overshoot(to=target):
            start = criterion.start or 0.0
            beyond = target + (target - start) * criterion.at_most / 100
            bounds = Bounds(criterion.of, min(start, beyond), max(start, beyond), target)
        case StepCriterion():
            bounds = Bounds(criterion.of, None, None, criterion.to)
        case _:
            return None
    return bounds


def _ground_of(criterion: Criterion, columns: Columns, scene: Mapping[str, Any]) -> Ground | None:
    match criterion:
        case Drift(axes="xyz" | "xy"):
            x, y, _ = _origin(criterion, columns)
            ground = Ground([(x, y, criterion.at_most)])
        case PathFollowing(along=list(corners)):
            corners = [*corners, *corners[: criterion.closed]]
            ground = Ground([], [(x, y) for x, y, _ in corners], 2 * criterion.at_most)
        case Reach(places=places, within=radius):
            ground = Ground([(x, y, radius) for place in places for x, y in _centers(place, scene)])
        case Landed(at=place, within=radius) if place is not None:
            ground = Ground([(x, y, radius) for x, y in _centers(place, scene)])
        case _:
            return None
    return ground


def _centers(place: str | Sequence[float], scene: Mapping[str, Any]) -> list[Point]:
    """Return a place over ground; for a name, or a path such as /Gate, the middle of each such object at the start."""
    if not isinstance(place, str):
        return [(place[0], place[1])]
    name = place.removeprefix("/")
    corners: dict[str, list[Sequence[float]]] = {}
    for box in scene["boxes"]:
        if name in (box["name"], box["object"]):
            corners.setdefault(box["object"], []).extend(box["corners"])
    return [(float(x), float(y)) for x, y, _ in (np.mean(some, axis=0) for some in corners.values())]


def _origin(criterion: Drift, columns: Columns) -> Sequence[float]:
    """Return the position (3,) in m from which a drift is measured."""
    if criterion.place is not None:
        return criterion.place
    row = min(int(np.searchsorted(columns["t"], criterion.after)), len(columns["t"]) - 1)
    return [float(columns[axis][row]) for axis in "xyz"]


def _over_time(bounds: Bounds, criterion: Criterion, columns: Columns, at: float | None) -> Chart | None:
    """Draw a column in the criterion's part of the flight; None if that has no two rows."""
    until = np.inf if criterion.until is None else criterion.until
    rows = np.flatnonzero((columns["t"] >= criterion.after) & (columns["t"] <= until))
    rows = rows[:: -(-len(rows) // _MAX_POINTS) or 1]
    if len(rows) < 2:
        return None
    times, values = columns["t"][rows], columns[bounds.of][rows]
    marked = [value for value in bounds[1:] if value is not None]
    low, high = min(*values, *marked), max(*values, *marked)
    room = _ROOM * (high - low) or 0.5
    low, high = low - room, high + room

    def place(time: float, value: float) -> Point:
        share = (time - times[0]) / (times[-1] - times[0])
        height = HEIGHT - _BOTTOM - _TOP
        return round(_LEFT + (WIDTH - _LEFT - 4) * share, 1), round(_TOP + height * (high - value) / (high - low), 1)

    def height_of(value: float) -> float:
        return place(times[0], value)[1]

    has_band = not (bounds.low is None and bounds.high is None)
    top = height_of(high if bounds.high is None else bounds.high)
    bottom = height_of(low if bounds.low is None else bounds.low)
    return Chart(
        title=f"{bounds.of} [{UNITS[bounds.of]}] over time{': green is allowed' if has_band else ''}",
        width=WIDTH,
        height=HEIGHT,
        flown=_points(place(time, value) for time, value in zip(times, values)),
        failed=None if at is None else place(*_at(at, times, values)),
        bands=[(top, round(bottom - top, 1))] if has_band else [],
        lines=[] if bounds.target is None else [height_of(bounds.target)],
        labels=[
            *((_LEFT - 4, height_of(value) + 4, "end", f"{value:.3g}") for value in marked),
            (_LEFT, HEIGHT - 4, "start", f"{times[0]:.3g} s"),
            (WIDTH - 4, HEIGHT - 4, "end", f"{times[-1]:.3g} s"),
        ],
    )


def _from_above(ground: Ground, columns: Columns, scene: Mapping[str, Any], at: float | None) -> Chart:
    """Draw the flown way from above, x to the right and y up."""
    circles, corridor, width = ground
    step = -(-len(columns["t"]) // _MAX_POINTS)
    way = np.column_stack((columns["x"], columns["y"]))[::step]
    ends = [way.min(axis=0), way.max(axis=0), *(np.array(corner) for corner in corridor)]
    ends += [np.array([x + side * radius, y + side * radius]) for x, y, radius in circles for side in (-1, 1)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    middle, half = (low + high) / 2, max(_SMALLEST, float((high - low).max()) / 2 * (1 + 2 * _ROOM))
    scale = SIDE / 2 / half

    def place(x: float, y: float) -> Point:
        return round(SIDE / 2 + scale * (x - middle[0]), 1), round(SIDE / 2 - scale * (y - middle[1]), 1)

    failed = None
    if at is not None:
        failed = place(*(float(_at(at, columns["t"], columns[axis])[1]) for axis in "xy"))
    return Chart(
        title=f"from above, {2 * half:.2g} m wide{': green is allowed' if circles or corridor else ''}",
        width=SIDE,
        height=SIDE,
        flown=_points(place(x, y) for x, y in way),
        failed=failed,
        circles=[(*place(x, y), round(scale * radius, 1)) for x, y, radius in circles],
        corridor=(_points(place(x, y) for x, y in corridor), round(scale * width, 1)),
        objects=[
            (_points(place(*box["corners"][corner][:2]) for corner in _BASE), _color(box["color"]))
            for box in scene["boxes"]
        ],
    )


def _at(time: float, times: np.ndarray, values: np.ndarray) -> Point:
    """Return a time within `times`, and the value then."""
    time = float(np.clip(time, times[0], times[-1]))
    return time, float(np.interp(time, times, values))


def _points(points: Any) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)


def _color(color: Sequence[float]) -> str:
    return f"rgb({' '.join(str(round(255 * part)) for part in color)})"


# ---- scene


def scene_of(scene: SceneParameters) -> dict[str, Any]:
    """Return the floor's side (m), and the bounding box of every visible shape at its start pose.

    A box has the `name` that scripts use, the unique name of its `object`, `corners` (8 points, m, world; bit 0, 1, 2
    of the index is the side along x, y, z) and a `color` (0 to 1).
    """
    entries = {entry.name: entry for entry in scene.objects if entry.name}
    boxes = []
    for entry in scene.objects:
        if not (isinstance(entry, ObjectParameters) and entry.visible):
            continue
        matrix, parent = entry.local, entry.parent
        for _ in range(_MAX_DEPTH):
            if parent not in entries:
                break
            matrix = frames.multiply(entries[parent].local, matrix)
            parent = entries[parent].parent
        names = {"name": entry.shown, "object": entry.name}
        boxes += [{**names, **_box(part, matrix)} for part in parts_of(entry.to_shape(), entry.color)]
    return {"floor": scene.floor.size, "boxes": boxes}


def _box(part: Part, world: Matrix) -> dict[str, Any]:
    matrix = frames.multiply(world, part.local)
    low, high = _bounds(part)
    corners = [
        frames.transform(matrix, [(high if index >> axis & 1 else low)[axis] for axis in range(3)])
        for index in range(8)
    ]
    return {
        "corners": [[round(float(value), _DIGITS) for value in corner] for corner in corners],
        "color": [round(float(value), 3) for value in part.color[:3]],
    }


def _bounds(part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates (3,) of a shape in its frame, in m."""
    try:
        surfaces = list(part.shape.triangles()) if isinstance(part.shape, DrawnShape) else []
    except (OSError, ValueError):  # the flight has reported it
        surfaces = []
    corners = [surface.corners.reshape(-1, 3) for surface in surfaces if len(surface.corners)]
    if not corners:
        return np.full(3, -_DEFAULT_SIDE / 2), np.full(3, _DEFAULT_SIDE / 2)
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)
