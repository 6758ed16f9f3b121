"""The line of a V-REP 3.x path through control points, and the frames along it. Metres, quaternions x, y, z, w.

At a control point a quadratic Bezier curve replaces the corner of the two straight segments; it begins and ends between
the point and the segments' midpoints. Rules and tolerances are those of V-REP's published source.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Quaternion, Vector

Channels = tuple[float, float, float, float]
_STRAIGHT = 0.99999  # cosine from which on two segments count as one
_SAME_ROTATION, _SAME_AXIS = math.radians(1.0), 0.99  # rad; cosine
_SAME_PLACE, _SAME_FRAME = 1e-4, math.radians(0.5)  # m, rad, within which points of the line are the same
LEAST_COUNT = 3  # points of a curve; with fewer the corner stays


class Station(NamedTuple):
    """A point of the line: its frame, how long (m) a follower pauses there, and V-REP's flags and channels."""

    position: Vector
    turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    pause: float = 0.0
    flags: int = 0
    channels: Channels = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ControlPoint:
    """A control point with `count` points in its curve; `before`, `after`: fractions of the ways to the midpoints."""

    at: Station
    before: float = 0.5
    after: float = 0.5
    count: int = 15

    @property
    def entry(self) -> dict[str, Any]:
        """The point with the keys of a scene file."""
        return {**self.at._asdict(), "factors": (self.before, self.after), "count": self.count}


def line(points: Sequence[ControlPoint], closed: bool) -> list[Station]:
    """Return the points of the line; `closed`: it leads from the last point to the first, which is not repeated."""
    if len(points) < 3:
        stations = [point.at for point in points]
    else:
        cyclic = [points[-1], *points, points[0]]
        corners = [_corner(*three) for three in zip(cyclic, cyclic[1:], cyclic[2:])]
        if not closed:
            corners[0], corners[-1] = [points[0].at], [points[-1].at]
        stations = list(itertools.chain.from_iterable(corners))
    return _without_repeats(stations)


def between(start: Station, end: Station, t: float) -> Station:
    """Interpolate between two stations, t from 0 to 1: positions linearly, orientations about one axis."""
    x, y, z = _mix(start.position, end.position, t)
    a, b, c, d = _mix(start.channels, end.channels, t)
    flags = start.flags if t < 0.5 else end.flags
    pause = start.pause + t * (end.pause - start.pause)
    return Station((x, y, z), _slerp(start.turn, end.turn, t), pause, flags, (a, b, c, d))


def angle_between(start: Quaternion, end: Quaternion) -> float:
    """Return the angle (rad, 0 to pi) of the rotation between two frames."""
    *axis, w = _rotation(start, end)
    return 2.0 * math.atan2(math.hypot(*axis), abs(w))


def _corner(previous: ControlPoint, point: ControlPoint, following: ControlPoint) -> list[Station]:
    """Return the points of the line at a control point between two others."""
    if point.count < LEAST_COUNT or not _is_curved(previous.at, point.at, following.at):
        return [point.at]
    first = between(point.at, between(previous.at, point.at, 0.5), point.before)
    last = between(point.at, between(point.at, following.at, 0.5), point.after)
    stations = []
    for index in range(point.count):
        t = index / (point.count - 1)
        station = between(between(first, point.at, t), between(point.at, last, t), t)
        offset = t * (point.before + point.after) / 2 - point.before / 2  # in segments; channels ignore the curve
        channels = between(point.at, previous.at if offset < 0 else following.at, abs(offset)).channels
        stations.append(station._replace(flags=point.at.flags, channels=channels))
    return stations


def _is_curved(before: Station, mid: Station, after: Station) -> bool:
    """Return whether direction or orientation change differently before and after a point, or the pause in both."""
    legs = [[b - a for a, b in zip(*two)] for two in ((before.position, mid.position), (mid.position, after.position))]
    lengths = [math.hypot(*leg) for leg in legs]
    if min(lengths) > 0 and _dot(*legs) < _STRAIGHT * lengths[0] * lengths[1]:
        return True
    if min(angle_between(before.turn, mid.turn), angle_between(mid.turn, after.turn)) > _SAME_ROTATION:
        axes = [_axis(_rotation(before.turn, mid.turn)), _axis(_rotation(mid.turn, after.turn))]
        if _dot(*axes) < _SAME_AXIS:
            return True
    return before.pause != mid.pause and mid.pause != after.pause


def _without_repeats(stations: Sequence[Station]) -> list[Station]:
    result: list[Station] = []
    for station in stations:
        if not (result and _is_same(result[-1], station)):
            result.append(station)
    return result


def _is_same(a: Station, b: Station) -> bool:
    is_near = math.dist(a.position, b.position) < _SAME_PLACE
    return is_near and angle_between(a.turn, b.turn) < _SAME_FRAME and a.pause == b.pause


def _mix(start: Sequence[float], end: Sequence[float], t: float) -> list[float]:
    return [a + t * (b - a) for a, b in zip(start, end)]


def _rotation(start: Quaternion, end: Quaternion) -> Quaternion:
    x, y, z, w = start
    return frames.multiply_quaternions((-x, -y, -z, w), end)


def _slerp(start: Quaternion, end: Quaternion, t: float) -> Quaternion:
    *axis, w = _rotation(start, end)
    length = math.hypot(*axis)
    if length == 0:
        return start
    half = math.atan2(length, abs(w)) * t
    scale = math.copysign(math.sin(half), w) / length
    x, y, z = (part * scale for part in axis)
    return frames.multiply_quaternions(start, (x, y, z, math.cos(half)))


def _axis(rotation: Quaternion) -> list[float]:
    *axis, w = rotation
    length = math.copysign(math.hypot(*axis), w)
    return [part / length if length else 0.0 for part in axis]


def _dot(u: Sequence[float], v: Sequence[float]) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


# ---- orientations that V-REP computes: z ahead, y outwards
# In a bend of the line y points out of the bend; on straight pieces it turns gradually from one bend to the next.

_Z_AXIS: Vector = (0.0, 0.0, 1.0)
_X_AXIS: Vector = (1.0, 0.0, 0.0)
_STEEP = 0.9  # z component of a direction from which on y is not taken upwards
_UNBENT, _STRAIGHT_LINE = 1 - 2e-7, 0.99999  # squared cosines: of two segments (a float's last bit), of an entire line
_SAME_SIDE = 0.999  # squared cosine
_NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)


def automatic_turns(points: Sequence[Vector], closed: bool, x_up: bool) -> list[Quaternion]:
    """Return a quaternion for each point of a line; `x_up`: x is as near to the line's own z axis as possible."""
    groups = [list(group) for _, group in itertools.groupby(range(len(points)), key=lambda index: points[index])]
    if closed and len(groups) > 1 and points[groups[0][0]] == points[groups[-1][0]]:
        groups[0] += groups.pop()
    orientations = _orientations([points[group[0]] for group in groups], closed, x_up)
    by_index = {index: orientation for group, orientation in zip(groups, orientations) for index in group}
    return [by_index[index] for index in range(len(points))]


def _orientations(points: Sequence[Vector], closed: bool, x_up: bool) -> list[Quaternion]:
    """Return the quaternions of points; neighbouring points must differ."""
    if len(points) < 2:
        return [_NO_ROTATION] * len(points)
    directions = [_unit(_difference(start, end)) for start, end in itertools.pairwise([*points, points[0]])]
    if len(points) == 2:
        ahead, sides = [directions[0]] * 2, [_side_of_straight_line(directions[0])] * 2
    elif all(_are_parallel(directions[0], direction, _STRAIGHT_LINE) for direction in directions[:-1]):
        ahead, sides = [directions[0]] * len(points), [_side_of_straight_line(directions[0])] * len(points)
    else:
        ahead, sides = _axes(points, directions, closed)
    return [_frame(z, frames.cross(z, _Z_AXIS) if x_up else y) for z, y in zip(ahead, sides)]


def _axes(points: Sequence[Vector], segments: Sequence[Vector], closed: bool) -> tuple[list[Vector], list[Vector]]:
    """Return the z and y axes of the points of a line that has a bend."""
    ahead, sides, last = list[Vector](), list[Vector | None](), len(points) - 1
    for index in range(len(points)):
        incoming, outgoing = segments[index - 1], segments[index]
        if not closed and index in (0, last):
            ahead.append(outgoing if index == 0 else incoming)
            sides.append(None)
        elif _are_parallel(incoming, outgoing, _UNBENT):
            ahead.append(incoming)
            sides.append(None)
        else:
            outwards = _unit(_difference(outgoing, incoming))
            ahead.append(_unit(frames.cross(_unit(frames.cross(incoming, outgoing)), outwards)))
            sides.append(outwards)
    return ahead, _interpolated_sides(points, ahead, sides, closed)


def _interpolated_sides(
    points: Sequence[Vector], ahead: Sequence[Vector], sides: Sequence[Vector | None], closed: bool
) -> list[Vector]:
    """Return the y axes, with the missing ones interpolated between two bends, by distance along the line."""
    complete = list(sides)
    bends = [index for index, side in enumerate(sides) if side is not None]
    count = len(points)
    if not bends:  # the line leads out and back: V-REP does not change such frames
        return [_side_of_straight_line(direction) for direction in ahead]
    for bend, next_bend in itertools.pairwise([*bends, bends[0] + count] if closed else bends):
        indices = [index % count for index in range(bend, next_bend + 1)]
        ends = [*itertools.accumulate(math.dist(points[a], points[b]) for a, b in itertools.pairwise(indices))]
        for index, along in zip(indices[1:-1], ends):
            complete[index] = _side_between(bend % count, next_bend % count, along / ends[-1], ahead, sides)
    for index in range(bends[0]):
        complete[index] = complete[index] or sides[bends[0]]
    for index in range(bends[-1], count):
        complete[index] = complete[index] or sides[bends[-1]]
    return [side or _Z_AXIS for side in complete]


def _side_between(
    bend: int, next_bend: int, t: float, ahead: Sequence[Vector], sides: Sequence[Vector | None]
) -> Vector:
    first, last = sides[bend] or _Z_AXIS, sides[next_bend] or _Z_AXIS
    if _dot(first, last) < 0 and _are_parallel(first, last, _SAME_SIDE):  # opposite: by way of -x, half way
        aside = frames.cross(ahead[bend], first)
        first, last, t = (first, aside, 2 * t) if t <= 0.5 else (aside, last, 2 * t - 1)
    x, y, z = _mix(first, last, t)
    return x, y, z


def _frame(z: Vector, side: Vector) -> Quaternion:
    """Return the quaternion of the frame with this z axis, and y as near to `side` as possible."""
    x = frames.cross(side, z)
    if math.hypot(*x) < 1e-9:
        return _NO_ROTATION
    x = _unit(x)
    y = frames.cross(z, x)
    return frames.to_quaternion((x[0], y[0], z[0], 0.0, x[1], y[1], z[1], 0.0, x[2], y[2], z[2], 0.0))


def _side_of_straight_line(ahead: Vector) -> Vector:
    return _Z_AXIS if ahead[2] < _STEEP else _X_AXIS  # in V-REP, too, only a line that climbs steeply has x


def _are_parallel(a: Vector, b: Vector, least: float) -> bool:
    return _dot(a, b) ** 2 >= least


def _difference(start: Vector, end: Vector) -> Vector:
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return (vector[0] / length, vector[1] / length, vector[2] / length) if length else vector
