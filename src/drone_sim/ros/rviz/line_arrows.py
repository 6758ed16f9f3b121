"""Arrows of lines for rviz, which turns lines to who looks and lights them from everywhere; not so its own arrows."""

from __future__ import annotations

import math

from drone_sim.mechanics.frames import Vector, cross

_HEAD = 0.045  # m, how far back its barbs reach
_SHARE = 0.4  # of a short arrow
_SPREAD = 0.5  # how far aside they reach, for each metre back
_CORNERS: tuple[Vector, ...] = ((1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1))


def arrow(start: Vector, way: Vector) -> list[Vector]:
    """Return the lines of an arrow from `start` along `way`, which is not 0 (m), point by point.

    They are its shaft and four barbs, each of which begins at the tip.
    """
    length = math.hypot(*way)
    x, y, z = ahead = way[0] / length, way[1] / length, way[2] / length
    across = cross(ahead, (1.0, 0.0, 0.0) if abs(x) < 0.9 else (0.0, 1.0, 0.0))
    aside = _scaled(across, 1 / math.hypot(*across))
    tip = _sum(start, way)
    back = min(_HEAD, _SHARE * length)
    neck = _sum(tip, (-back * x, -back * y, -back * z))
    points = [start, tip]
    for direction in (aside, cross(ahead, aside)):
        for reach in (_SPREAD * back, -_SPREAD * back):
            points += [tip, _sum(neck, _scaled(direction, reach))]
    return points


def star(middle: Vector, half: float) -> list[Vector]:
    """Return the four diagonals of a cube with half a side so long (m): a cross from wherever it is seen."""
    return [_sum(middle, _scaled(corner, reach)) for corner in _CORNERS for reach in (-half, half)]


def _scaled(vector: Vector, factor: float) -> Vector:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]
