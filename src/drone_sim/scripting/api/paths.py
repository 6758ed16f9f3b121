"""`sim`: paths, as objects (3.x) and as tables of numbers (4.x). Metres and radians."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import Path
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Handle, Number, Numbers, WrongValue, numbers

_MOST = 1_000_000  # numbers of a table
_MOST_POINTS = 10_000  # of a path that is made
_CLOSED, _LOOKS_ALONG = 2, 16  # options of createPath


class Paths(Functions):
    """Paths, as objects (3.x) and as tables of numbers (4.x). Metres and radians."""

    # ---- objects

    @sim("345")
    def getPathLength(self, handle: Handle) -> float:
        """Return the length of a path in m."""
        return self._path(handle).length

    @sim("345")
    def getPositionOnPath(self, handle: Handle, relativeDistance: Number) -> list[float]:
        """Return the place in the world at a share of a path, from 0 to 1."""
        return list(frames.position(self._on_path(handle, relativeDistance)))

    @sim("345")
    def getOrientationOnPath(self, handle: Handle, relativeDistance: Number) -> list[float]:
        """Return the Euler angles, in the world, of the frame at a share of a path: x ahead, z up."""
        return list(frames.to_euler(self._on_path(handle, relativeDistance)))

    @sim("34")
    def getDataOnPath(self, handle: Handle, relativeDistance: Number) -> tuple[int, list[float]]:
        """Return flags and four numbers that a path may carry along: all 0 here, where paths carry none."""
        self._on_path(handle, relativeDistance)
        return 0, [0.0] * 4

    @sim("34")
    def getClosestPositionOnPath(self, handle: Handle, position: Sequence[float]) -> float:
        """Return the share of a path, from 0 to 1, at which it comes nearest to a place in the world."""
        path = self._path(handle)
        place = frames.transform(frames.invert(path.matrix()), numbers(position, 3))
        return path.nearest(place) / path.length if path.length else 0.0

    @sim("345")
    def createPath(
        self, ctrlPts: Numbers, options: int = 0, subdiv: int = 100, smoothness: Number = 1.0, *_: Any
    ) -> int:
        """Make a path through poses of 7 numbers each, one after the other; return its handle.

        `options`: 2 closed, 16 it looks along itself, not as the poses do. It has `subdiv` points, and its corners are
        rounded off over `smoothness` (0 to 1) of each piece.
        """
        operations = self._surroundings.operations
        if not isinstance(ctrlPts, Sequence):
            raise WrongValue("poses of control points are expected: paths without points are not made here")
        if operations is None:
            raise ValueError("there is no scene here")
        (smooth,), count = numbers((smoothness,), 1), int(subdiv)
        if not 2 <= count <= _MOST_POINTS:
            raise WrongValue(f"a subdiv of 2 to {_MOST_POINTS} points is expected, not {count}")
        closed = bool(int(options) & _CLOSED)
        poses = smoothed(_points(ctrlPts, 7), closed, min(max(smooth, 0.0), 1.0), count)
        said: dict[str, Any] = {"points": [pose[:3] for pose in poses], "closed": closed}
        if not int(options) & _LOOKS_ALONG:
            said["turns"] = [pose[3:] for pose in poses]
        entry = {"name": operations.free_name("Path"), "alias": "Path", "kind": "path", **said}
        return self._surroundings.outside(lambda: operations.add([entry])[0])

    @sim("345")
    def getPathPosition(self, handle: Handle) -> float:
        """Return what setPathPosition has set, m."""
        return self._path(handle).position_along

    @sim("345")
    def setPathPosition(self, handle: Handle, position: Number) -> None:
        """Keep how far along (m) somebody is who follows a path."""
        (self._path(handle).position_along,) = numbers((position,), 1)

    def _on_path(self, handle: int, share: float) -> Matrix:
        path, (along,) = self._path(handle), numbers((share,), 1)
        return frames.multiply(path.matrix(), path.at(along * path.length))

    def _path(self, handle: int) -> Path:
        return self._found(handle, Path, "a path")

    # ---- tables

    @sim("45")
    def getPathLengths(self, path: Numbers, dof: int, _callback: Any = None) -> tuple[list[float], float]:
        """Return how far along each point of a table lies, and the length; `dof` numbers a point, of which 3 are m."""
        points = _points(path, dof)
        pieces = (math.dist(one[:3], other[:3]) for one, other in itertools.pairwise(points))
        lengths = list(itertools.accumulate(pieces, initial=0.0))
        return lengths, lengths[-1]

    @sim("45")
    def getPathInterpolatedConfig(
        self, path: Numbers, lengths: Numbers, t: Number, _method: Any = None, _types: Any = None
    ) -> list[float]:
        """Return the numbers of a table's point so far along as getPathLengths counts, between two straight on."""
        ends = numbers(lengths, len(lengths))
        if len(ends) < 2 or len(path) % len(ends):
            raise WrongValue(f"a path of {len(ends)} points has as many numbers for each, not {len(path)} in all")
        points, (along,) = _points(path, len(path) // len(ends)), numbers((t,), 1)
        index = min(max(bisect.bisect_right(ends, along) - 1, 0), len(ends) - 2)
        piece = ends[index + 1] - ends[index]
        share = min(max((along - ends[index]) / piece, 0.0), 1.0) if piece > 0 else 0.0
        between = [a + share * (b - a) for a, b in zip(points[index], points[index + 1])]
        return _with_unit_quaternion(between, points[index], points[index + 1], share)


def _points(path: Sequence[float], dof: int) -> list[tuple[float, ...]]:
    count = int(dof)
    if count < 1 or len(path) > _MOST or not len(path) or len(path) % count:
        raise WrongValue(f"a table with {count} numbers for each point is expected, not {len(path)} in all")
    flat = numbers(path, len(path))
    return [flat[first : first + count] for first in range(0, len(flat), count)]


def smoothed(points: Sequence[Sequence[float]], closed: bool, smoothness: float, count: int) -> list[list[float]]:
    """Return so many points along a line through points, whose corners are parabolas over a share of each piece."""
    corners = [*points, points[0]] if closed and points[0] != points[-1] else [*points]
    if len(corners) < 2:
        raise WrongValue("two control points or more are expected")
    pieces = len(corners) - 1
    return [_rounded(corners, closed, smoothness, pieces * index / (count - 1)) for index in range(count)]


def _rounded(corners: Sequence[Sequence[float]], closed: bool, smoothness: float, along: float) -> list[float]:
    """Return the point so many pieces along, which is rounded off where a corner is nearer than half its share."""
    pieces = len(corners) - 1
    corner = round(along)
    index, share = min(int(along), pieces - 1), along - corner
    if abs(share) >= smoothness / 2 or (corner in (0, pieces) and not closed):
        return _between(corners[index], corners[index + 1], along - index)
    before, here, after = corners[corner - 1 if corner else -2], corners[corner], corners[corner % pieces + 1]
    reach = share / smoothness + 0.5  # from 0 to 1 through the corner
    way = smoothness / 2
    one, other = _between(before, here, 1 - way * (1 - reach)), _between(here, after, way * reach)
    return _between(one, other, reach)


def _between(one: Sequence[float], other: Sequence[float], share: float) -> list[float]:
    return _with_unit_quaternion([a + share * (b - a) for a, b in zip(one, other)], one, other, share)


def _with_unit_quaternion(
    between: list[float], one: Sequence[float], other: Sequence[float], share: float
) -> list[float]:
    """Return a point between two; of 7 numbers the last four are a quaternion, the shorter way round."""
    if len(between) != 7:
        return between
    sign = 1.0 if sum(a * b for a, b in zip(one[3:], other[3:])) >= 0 else -1.0
    turn = [a + share * (sign * b - a) for a, b in zip(one[3:], other[3:])]
    length = math.hypot(*turn)
    return [*between[:3], *(part / length for part in turn)] if length else between
