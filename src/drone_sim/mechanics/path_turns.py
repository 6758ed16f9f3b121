"""The orientations that V-REP 3.x computes for the points of a path: z ahead, y outwards.

In a bend of the line y points out of the bend; on straight pieces it turns gradually from one bend to the next. Rules
and tolerances are those of V-REP's published source.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Quaternion, Vector

_Z_AXIS: Vector = (0.0, 0.0, 1.0)
_X_AXIS: Vector = (1.0, 0.0, 0.0)
_STEEP = 0.9  # z component of a direction from which on y is not taken upwards
_UNBENT, _STRAIGHT = 1 - 2e-7, 0.99999  # squared cosines: of two segments (a float's last bit), of an entire line
_SAME_SIDE = 0.999  # squared cosine
_NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)


def automatic(points: Sequence[Vector], closed: bool, x_up: bool) -> list[Quaternion]:
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
    elif all(_are_parallel(directions[0], direction, _STRAIGHT) for direction in directions[:-1]):
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
        return _mix(first, aside, 2 * t) if t <= 0.5 else _mix(aside, last, 2 * t - 1)
    return _mix(first, last, t)


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


def _mix(start: Vector, end: Vector, t: float) -> Vector:
    x, y, z = (a + t * (b - a) for a, b in zip(start, end))
    return x, y, z


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return (vector[0] / length, vector[1] / length, vector[2] / length) if length else vector


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
