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
