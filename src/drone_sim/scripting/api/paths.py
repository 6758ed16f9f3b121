"""`sim`: paths as objects (3.x) and as tables of numbers (4.x), in m and rad."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import AUTOMATIC, COUNTS, OWN, X_UP, ControlledPath, Path, nearest
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Handle, Number, Numbers, ThreeNumbers, WrongValue, numbers

_MOST = 1_000_000  # numbers of a table
_MOST_POINTS = 10_000  # points of a new path
_CLOSED, _LOOKS_ALONG = 2, 16  # options of createPath
_DEFAULT = -1
_PROPERTY = {
    word: CONSTANTS[f"pathproperty_{name}"]
    for word, name in (("closed", "closed_path"), ("flat", "flat_path"), ("automatic", "automatic_orientation"))
}
_USUAL, _X_UP = _PROPERTY["automatic"], CONSTANTS["pathproperty_keep_x_up"]
_WITHOUT_DATA, _WITH_DATA = 11, 16  # numbers of a control point


class Paths(Functions):
    """Paths, as objects (3.x) and as tables of numbers (4.x), in m and rad."""

    # ---- objects

    @sim("345")
    def getPathLength(self, handle: Handle) -> float:
        """Return the length of a path in m; a curved path may also count turns (docs/scenes.md)."""
        return self._path(handle).length

    @sim("345")
    def getPositionOnPath(self, handle: Handle, relativeDistance: Number) -> list[float]:
        """Return the position (world) at a fraction of a path, from 0 to 1."""
        return list(frames.position(self._on_path(handle, relativeDistance)))

    @sim("345")
    def getOrientationOnPath(self, handle: Handle, relativeDistance: Number) -> list[float]:
        """Return the Euler angles (world) of the frame at a fraction of a path: x ahead, z up.

        A curved path has its own frames: z ahead, y outwards, or the orientations of its control points.
        """
        return list(frames.to_euler(self._on_path(handle, relativeDistance)))

    @sim("34")
    def getDataOnPath(self, handle: Handle, relativeDistance: Number) -> tuple[int, list[float]]:
        """Return the flags and four numbers of a curved path at a fraction; 0 for other paths."""
        path = self._path(handle)
        return path.carried(numbers((relativeDistance,), 1)[0] * path.length)

    @sim("34")
    def getClosestPositionOnPath(self, handle: Handle, position: Sequence[float]) -> float:
        """Return the fraction, from 0 to 1, of the point of a path nearest to a position (world)."""
        path = self._path(handle)
        place = frames.transform(frames.invert(path.matrix()), numbers(position, 3))
        return path.nearest(place) / path.length if path.length else 0.0

    @sim("345")
    def createPath(
        self, ctrlPts: Numbers | int = -1, options: Any = 0, subdiv: Any = 100, smoothness: Any = 1.0, *_: Any
    ) -> int:
        """Create a path through a list of poses of 7 numbers each; return its handle.

        `options`: 2 closed; 16 with orientations along the path instead of the poses' own. The path has `subdiv`
        points, and its corners are rounded over `smoothness` (0 to 1) of each piece. In 3.x: (sim.pathproperty_...,
        intParams, floatParams), -1 for V-REP's defaults, creates a curved path without points. intParams[1] is the
        measure of its length (sim.distcalcmethod_...); floatParams[1] and [2] are the lengths of a turn (m/rad) and of
        a pause; indices from 0.
        """
        if not isinstance(ctrlPts, Sequence):
            return self._empty_path(ctrlPts, options or None, subdiv if isinstance(subdiv, Sequence) else None)
        (smooth,), count = numbers((smoothness,), 1), int(subdiv)
        if not 2 <= count <= _MOST_POINTS:
            raise WrongValue(f"subdiv = {count}: must be 2 to {_MOST_POINTS} points")
        closed = bool(int(options) & _CLOSED)
        poses = smoothed(_points(ctrlPts, 7), closed, min(max(smooth, 0.0), 1.0), count)
        entry: dict[str, Any] = {"points": [pose[:3] for pose in poses], "closed": closed}
        if not int(options) & _LOOKS_ALONG:
            entry["turns"] = [pose[3:] for pose in poses]
        return self._add("Path", kind="path", **entry)

    def _empty_path(self, attributes: int, whole: Sequence[float] | None, real: Sequence[float] | None) -> int:
        bits = int(attributes) if attributes != _DEFAULT else _USUAL
        entry: dict[str, Any] = {"closed": bool(bits & _PROPERTY["closed"]), "flat": bool(bits & _PROPERTY["flat"])}
        entry["orientation"] = (X_UP if bits & _X_UP else AUTOMATIC) if bits & _PROPERTY["automatic"] else OWN
        if whole is not None:
            method = int(numbers(whole, 3)[1])
            if method not in range(len(COUNTS)):
                raise WrongValue("intParams must contain one of sim.distcalcmethod_...")
            entry["counts"] = [*COUNTS][method]
        if real is not None:
            _, entry["metres_per_radian"], entry["metres_per_pause"] = numbers(real, 3)
        return self._add("Path", kind="curved_path", control_points=[], **entry)

    @sim("34")
    def insertPathCtrlPoints(self, handle: Handle, options: int, startIndex: int, ptCnt: int, ptData: Numbers) -> int:
        """Insert control points into a curved path before an index, from 0. Return 1.

        `options`: 1 closes the path, otherwise it is open; 2 (3.3): 16 numbers for each point, otherwise 11. These are
        position (m) and Euler angles in the path's frame, a speed (ignored), a pause, the number of points of the
        curve, and two factors; then the flags and four numbers of getDataOnPath.
        """
        path, count = self._curved(handle), int(ptCnt)
        size = _WITH_DATA if int(options) & 2 else _WITHOUT_DATA
        points = _points(ptData, size) if count else []
        if len(points) != count:
            raise WrongValue(f"expected {size} numbers for each of {count} points, not {len(ptData)}")
        entries = [point.entry for point in path.control_points]
        index = min(max(int(startIndex), 0), len(entries))
        entries[index:index] = [_control_point(point, path.is_flat) for point in points]
        self._change(handle, control_points=entries, closed=bool(int(options) & 1) and len(entries) > 2)
        return 1

    @sim("34")
    def cutPathCtrlPoints(self, handle: Handle, startIndex: int, ptCnt: int) -> int:
        """Remove a number of control points from a curved path, starting at an index (from 0); -1: all. Return 1."""
        entries = [point.entry for point in self._curved(handle).control_points]
        first, count = int(startIndex), int(ptCnt)
        if first < 0 or count < 0:
            entries = []
        else:
            del entries[first : first + count]
        self._change(handle, control_points=entries)
        return 1

    def _change(self, handle: int, **values: Any) -> None:
        along = self._path(handle).position_along
        self._do(lambda scene: scene.change(int(handle), along=along, **values))

    def _curved(self, handle: int) -> ControlledPath:
        return self._found(handle, ControlledPath, "a curved path")

    @sim("345")
    def getPathPosition(self, handle: Handle) -> float:
        """Return the distance (m) stored by setPathPosition."""
        return self._path(handle).position_along

    @sim("345")
    def setPathPosition(self, handle: Handle, position: Number) -> None:
        """Store the distance (m) of an object along a path."""
        (self._path(handle).position_along,) = numbers((position,), 1)

    def _on_path(self, handle: int, share: float) -> Matrix:
        path, (along,) = self._path(handle), numbers((share,), 1)
        return frames.multiply(path.matrix(), path.at(along * path.length))

    def _path(self, handle: int) -> Path:
        return self._found(handle, Path, "a path")

    # ---- tables

    @sim("45")
    def getPathLengths(self, path: Numbers, dof: int, _callback: Any = None) -> tuple[list[float], float]:
        """Return the distance of each point along a path table, and its length; a point has `dof` numbers, 3 in m."""
        points = _points(path, dof)
        pieces = (math.dist(start[:3], end[:3]) for start, end in itertools.pairwise(points))
        lengths = list(itertools.accumulate(pieces, initial=0.0))
        return lengths, lengths[-1]

    @sim("45")
    def getPathInterpolatedConfig(
        self, path: Numbers, lengths: Numbers, t: Number, _method: Any = None, _types: Any = None
    ) -> list[float]:
        """Return the interpolated point of a path table at a distance; `lengths` are from getPathLengths."""
        ends = numbers(lengths, len(lengths))
        if len(ends) < 2 or len(path) % len(ends):
            raise WrongValue(
                f"a path of {len(ends)} points must have equally many numbers for each, not {len(path)} in all"
            )
        points, (along,) = _points(path, len(path) // len(ends)), numbers((t,), 1)
        index = min(max(bisect.bisect_right(ends, along) - 1, 0), len(ends) - 2)
        piece = ends[index + 1] - ends[index]
        share = min(max((along - ends[index]) / piece, 0.0), 1.0) if piece > 0 else 0.0
        between = [a + share * (b - a) for a, b in zip(points[index], points[index + 1])]
        return _with_unit_quaternion(between, points[index], points[index + 1], share)

    @sim("45")
    def getClosestPosOnPath(self, path: Numbers, lengths: Numbers, absPt: ThreeNumbers) -> float:
        """Return the distance of the point nearest to a position along a path table; `lengths` as of getPathLengths."""
        ends = numbers(lengths, len(lengths))
        if len(ends) < 2 or len(path) % len(ends) or len(path) < 3 * len(ends):
            raise WrongValue(f"expected 3 numbers or more for each of {len(ends)} points, not {len(path)} in all")
        x, y, z = numbers(absPt, 3)
        points = [point[:3] for point in _points(path, len(path) // len(ends))]
        return nearest(points, ends, (x, y, z))

    @sim("5")
    def resamplePath(
        self, path: Numbers, lengths: Numbers, finalConfigCnt: int, method: Any = None, types: Any = None
    ) -> list[float]:
        """Return a path table with a number of points at equal distances along another path table."""
        count = int(finalConfigCnt)
        if not 2 <= count <= _MOST_POINTS:
            raise WrongValue(f"expected 2 to {_MOST_POINTS} points, not {count}")
        shares = (index / (count - 1) * lengths[-1] for index in range(count))
        return [one for at in shares for one in self.getPathInterpolatedConfig(path, lengths, at, method, types)]


def _points(path: Sequence[float], dof: int) -> list[tuple[float, ...]]:
    count = int(dof)
    if count < 1 or len(path) > _MOST or not len(path) or len(path) % count:
        raise WrongValue(f"expected a table with {count} numbers for each point, not {len(path)} in all")
    flat = numbers(path, len(path))
    return [flat[first : first + count] for first in range(0, len(flat), count)]


def _control_point(values: Sequence[float], is_flat: bool) -> dict[str, Any]:
    """Return a control point as in a scene file, from V-REP's 11 or 16 numbers."""
    x, y, z = values[:3]
    turn = frames.to_quaternion(frames.from_euler((0.0, 0.0, 0.0), values[3:6]))
    count = min(max(round(values[8]), 1), 100)
    entry = {
        "position": [x, y, 0.0 if is_flat else z],
        "turn": list(turn),
        "pause": min(max(values[7], 0.0), 1000.0),
        "count": count,
        "factors": [min(max(factor, 0.1), 0.99) for factor in values[9:11]],
    }
    data = {"flags": round(values[11]), "channels": list(values[12:])} if len(values) == _WITH_DATA else {}
    return {**entry, **data}


def smoothed(points: Sequence[Sequence[float]], closed: bool, smoothness: float, count: int) -> list[list[float]]:
    """Return `count` points along a line through `points`; its corners are parabolas over a fraction of each piece."""
    corners = [*points, points[0]] if closed and points[0] != points[-1] else [*points]
    if len(corners) < 2:
        raise WrongValue("expected two control points or more")
    pieces = len(corners) - 1
    return [_rounded(corners, closed, smoothness, pieces * index / (count - 1)) for index in range(count)]


def _rounded(corners: Sequence[Sequence[float]], closed: bool, smoothness: float, along: float) -> list[float]:
    """Return the point at `along` (in pieces); it is rounded if a corner is closer than half of `smoothness`."""
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
    """Return the interpolated point; of 7 numbers, the last four are a quaternion on the shorter arc."""
    if len(between) != 7:
        return between
    sign = 1.0 if sum(a * b for a, b in zip(one[3:], other[3:])) >= 0 else -1.0
    turn = [a + share * (sign * b - a) for a, b in zip(one[3:], other[3:])]
    length = math.hypot(*turn)
    return [*between[:3], *(part / length for part in turn)] if length else between
