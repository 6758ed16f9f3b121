"""The frames that V-REP 3.x gives the points of a path by itself: z ahead, y outwards.

Where the line bends, y points out of the bend; on straight pieces it turns from one bend to the next. Rules and
tolerances are those of V-REP's published source.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Quaternion, Vector

_UP: Vector = (0.0, 0.0, 1.0)
_AHEAD: Vector = (1.0, 0.0, 0.0)
_STEEP = 0.9  # z of a direction, beyond which y is not upwards
_NO_BEND, _STRAIGHT = 1 - 2e-7, 0.99999  # squared cosines: of two pieces (a float's last bit), of all of a line
_SAME_SIDE = 0.999
_UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


def automatic(points: Sequence[Vector], closed: bool, x_up: bool) -> list[Quaternion]:
    """Return the quaternion of each point of a line; `x_up`: x is as near to the line's own z axis as can be."""
    groups = [list(group) for _, group in itertools.groupby(range(len(points)), key=lambda index: points[index])]
    if closed and len(groups) > 1 and points[groups[0][0]] == points[groups[-1][0]]:
        groups[0] += groups.pop()
    turns = _distinct([points[group[0]] for group in groups], closed, x_up)
    by_index = {index: turn for group, turn in zip(groups, turns) for index in group}
    return [by_index[index] for index in range(len(points))]


def _distinct(points: Sequence[Vector], closed: bool, x_up: bool) -> list[Quaternion]:
    """Return the quaternions of points none of which is where the next one is."""
    if len(points) < 2:
        return [_UPRIGHT] * len(points)
    pieces = [_unit(_from(one, other)) for one, other in itertools.pairwise([*points, points[0]])]
    if len(points) == 2:
        ahead, sides = [pieces[0]] * 2, [_any_side(pieces[0])] * 2
    elif all(_are_along(pieces[0], one, _STRAIGHT) for one in pieces[:-1]):
        ahead, sides = [pieces[0]] * len(points), [_any_side(pieces[0])] * len(points)
    else:
        ahead, sides = _bent(points, pieces, closed)
    return [_frame(z, frames.cross(z, _UP) if x_up else y) for z, y in zip(ahead, sides)]


def _bent(points: Sequence[Vector], pieces: Sequence[Vector], closed: bool) -> tuple[list[Vector], list[Vector]]:
    """Return where z and y of each point look, of a line with a bend."""
    ahead, sides, last = list[Vector](), list[Vector | None](), len(points) - 1
    for index in range(len(points)):
        came, goes = pieces[index - 1], pieces[index]
        if not closed and index in (0, last):
            ahead.append(goes if index == 0 else came)
            sides.append(None)
        elif _are_along(came, goes, _NO_BEND):
            ahead.append(came)
            sides.append(None)
        else:
            outwards = _unit(_from(goes, came))
            ahead.append(_unit(frames.cross(_unit(frames.cross(came, goes)), outwards)))
            sides.append(outwards)
    return ahead, _filled(points, ahead, sides, closed)


def _filled(
    points: Sequence[Vector], ahead: Sequence[Vector], sides: Sequence[Vector | None], closed: bool
) -> list[Vector]:
    """Return the sides with those between two bends turned from one to the other, by their distance along the line."""
    found = list(sides)
    bends = [index for index, side in enumerate(sides) if side is not None]
    count = len(points)
    if not bends:  # it goes there and back: V-REP leaves such frames as they were
        return [_any_side(one) for one in ahead]
    for one, other in itertools.pairwise([*bends, bends[0] + count] if closed else bends):
        way = [index % count for index in range(one, other + 1)]
        ends = [*itertools.accumulate(math.dist(points[a], points[b]) for a, b in itertools.pairwise(way))]
        for index, along in zip(way[1:-1], ends):
            found[index] = _side_between(one % count, other % count, along / ends[-1], ahead, sides)
    for index in range(bends[0]):
        found[index] = found[index] or sides[bends[0]]
    for index in range(bends[-1], count):
        found[index] = found[index] or sides[bends[-1]]
    return [one or _UP for one in found]


def _side_between(
    one: int, other: int, share: float, ahead: Sequence[Vector], sides: Sequence[Vector | None]
) -> Vector:
    first, last = sides[one] or _UP, sides[other] or _UP
    if _dot(first, last) < 0 and _are_along(first, last, _SAME_SIDE):  # opposite: by way of -x, in the middle
        aside = frames.cross(ahead[one], first)
        return _mixed(first, aside, 2 * share) if share <= 0.5 else _mixed(aside, last, 2 * share - 1)
    return _mixed(first, last, share)


def _frame(z: Vector, side: Vector) -> Quaternion:
    """Return the quaternion of a frame with that z axis, and y as near to a side as can be."""
    x = frames.cross(side, z)
    if math.hypot(*x) < 1e-9:
        return _UPRIGHT
    x = _unit(x)
    y = frames.cross(z, x)
    return frames.to_quaternion((x[0], y[0], z[0], 0.0, x[1], y[1], z[1], 0.0, x[2], y[2], z[2], 0.0))


def _any_side(ahead: Vector) -> Vector:
    """Return the side of a line without a bend."""
    return _UP if ahead[2] < _STEEP else _AHEAD


def _are_along(one: Vector, other: Vector, least: float) -> bool:
    return _dot(one, other) ** 2 >= least


def _from(one: Vector, other: Vector) -> Vector:
    return other[0] - one[0], other[1] - one[1], other[2] - one[2]


def _mixed(one: Vector, other: Vector, share: float) -> Vector:
    x, y, z = (a + share * (b - a) for a, b in zip(one, other))
    return x, y, z


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return (vector[0] / length, vector[1] / length, vector[2] / length) if length else vector


def _dot(one: Vector, other: Vector) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
