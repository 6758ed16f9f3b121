"""The line of V-REP 3.x through control points, and the frames along it. Metres, quaternions x, y, z, w.

At a control point the line leaves the straight pieces for a quadratic Bezier curve, which begins and ends between the
point and the middles of its pieces. Rules and tolerances are those of V-REP's published source.
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
_STRAIGHT = 0.99999  # cosine beyond which two pieces are one
_SAME_TURN, _SAME_AXIS = math.radians(1.0), 0.99  # rad; cosine
_SAME_PLACE, _SAME_FRAME = 1e-4, math.radians(0.5)  # m, rad: points of the line that are one
LEAST_COUNT = 3  # points of a curve; with fewer there is none


class Station(NamedTuple):
    """A point of the line: its frame, how long (m) one stands there, and what it carries along."""

    position: Vector
    turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    pause: float = 0.0
    flags: int = 0
    channels: Channels = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ControlPoint:
    """A control point: its curve has so many points, and begins and ends at a share of the ways to the middles."""

    at: Station
    before: float = 0.5
    after: float = 0.5
    count: int = 15

    @property
    def said(self) -> dict[str, Any]:
        """The same in the words of a scene file."""
        return {**self.at._asdict(), "factors": (self.before, self.after), "count": self.count}


def line(points: Sequence[ControlPoint], closed: bool) -> list[Station]:
    """Return the points of the line; `closed`: it goes on from the last one to the first, which is not repeated."""
    if len(points) < 3:
        found = [one.at for one in points]
    else:
        around = [points[-1], *points, points[0]]
        inner = [_corner(*three) for three in zip(around, around[1:], around[2:])]
        if not closed:
            inner[0], inner[-1] = [points[0].at], [points[-1].at]
        found = list(itertools.chain.from_iterable(inner))
    return _without_doubles(found)


def between(one: Station, other: Station, share: float) -> Station:
    """Interpolate between two stations, at a share from 0 to 1: in a straight line, and turned about one axis."""
    x, y, z = _mixed(one.position, other.position, share)
    a, b, c, d = _mixed(one.channels, other.channels, share)
    flags = one.flags if share < 0.5 else other.flags
    pause = one.pause + share * (other.pause - one.pause)
    return Station((x, y, z), _turned(one.turn, other.turn, share), pause, flags, (a, b, c, d))


def angle_between(one: Quaternion, other: Quaternion) -> float:
    """Return the angle (rad, 0 to pi) of the turn from one frame to another."""
    *axis, w = _turn(one, other)
    return 2.0 * math.atan2(math.hypot(*axis), abs(w))


def _corner(one: ControlPoint, here: ControlPoint, other: ControlPoint) -> list[Station]:
    """Return the points of the line at a control point, between two others."""
    if here.count < LEAST_COUNT or not _is_curved(one.at, here.at, other.at):
        return [here.at]
    first = between(here.at, between(one.at, here.at, 0.5), here.before)
    last = between(here.at, between(here.at, other.at, 0.5), here.after)
    found = []
    for index in range(here.count):
        share = index / (here.count - 1)
        station = between(between(first, here.at, share), between(here.at, last, share), share)
        along = share * (here.before + here.after) / 2 - here.before / 2  # in pieces; what is carried is not rounded
        carried = between(here.at, one.at if along < 0 else other.at, abs(along)).channels
        found.append(station._replace(flags=here.at.flags, channels=carried))
    return found


def _is_curved(one: Station, here: Station, other: Station) -> bool:
    """Tell whether way, frame or pause change differently before and after a point."""
    ways = [[b - a for a, b in zip(*pair)] for pair in ((one.position, here.position), (here.position, other.position))]
    lengths = [math.hypot(*way) for way in ways]
    if min(lengths) > 0 and _dot(*ways) < _STRAIGHT * lengths[0] * lengths[1]:
        return True
    if min(angle_between(one.turn, here.turn), angle_between(here.turn, other.turn)) > _SAME_TURN:
        axes = [_axis(_turn(one.turn, here.turn)), _axis(_turn(here.turn, other.turn))]
        if _dot(*axes) < _SAME_AXIS:
            return True
    return one.pause != here.pause != other.pause


def _without_doubles(stations: Sequence[Station]) -> list[Station]:
    found: list[Station] = []
    for one in stations:
        if not (found and _is_same(found[-1], one)):
            found.append(one)
    return found


def _is_same(one: Station, other: Station) -> bool:
    is_near = math.dist(one.position, other.position) < _SAME_PLACE
    return is_near and angle_between(one.turn, other.turn) < _SAME_FRAME and one.pause == other.pause


def _mixed(one: Sequence[float], other: Sequence[float], share: float) -> list[float]:
    return [a + share * (b - a) for a, b in zip(one, other)]


def _turn(one: Quaternion, other: Quaternion) -> Quaternion:
    x, y, z, w = one
    return frames.multiply_quaternions((-x, -y, -z, w), other)


def _turned(one: Quaternion, other: Quaternion, share: float) -> Quaternion:
    *axis, w = _turn(one, other)
    length = math.hypot(*axis)
    if length == 0:
        return one
    half = math.atan2(length, abs(w)) * share
    scale = math.copysign(math.sin(half), w) / length
    x, y, z = (part * scale for part in axis)
    return frames.multiply_quaternions(one, (x, y, z, math.cos(half)))


def _axis(turn: Quaternion) -> list[float]:
    *axis, w = turn
    length = math.copysign(math.hypot(*axis), w)
    return [part / length if length else 0.0 for part in axis]


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    return sum(a * b for a, b in zip(one, other))
