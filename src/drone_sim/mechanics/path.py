"""A path through points, as an object of the scene. Metres, in its own frame where nothing else is said."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.scene_object import SceneObject


class Path(SceneObject):
    """Straight pieces from point to point."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix,
        points: Sequence[Sequence[float]],
        closed: bool = False,
        turns: Sequence[Sequence[float]] = (),
    ):
        """Take at least two points (m); `closed`: the path goes on from the last one to the first.

        `turns` are the points' quaternions (x, y, z, w); without any they look along the path.
        """
        super().__init__(names, alias, parent, local, kind="path")
        self.points: list[Vector] = [(x, y, z) for x, y, z in points]
        self.closed = closed
        if closed and self.points[0] != self.points[-1]:
            self.points.append(self.points[0])
        self._turns = [*turns, turns[0]][: len(self.points)] if turns else []
        self._position_along = 0.0
        pieces = (math.dist(one, other) for one, other in itertools.pairwise(self.points))
        self._ends = list(itertools.accumulate(pieces, initial=0.0))

    @property
    def length(self) -> float:
        """From its beginning to its end, m."""
        return self._ends[-1]

    @property
    def position_along(self) -> float:
        """Position (m) of a follower, kept as in V-REP 3.x: within the path's ends, or wrapped around if closed."""
        return self._position_along

    @position_along.setter
    def position_along(self, along: float) -> None:
        self._position_along = self._within(along)

    def _within(self, along: float) -> float:
        if self.closed and self.length:
            return along % self.length
        return min(max(along, 0.0), self.length)

    @property
    def table(self) -> list[float]:
        """Its points as 4.x keeps them in an object's data PATH: x, y, z and the quaternion x, y, z, w of each."""
        if self._turns or not self.points:
            return [one for point, turn in zip(self.points, self._turns) for one in (*point, *turn)]
        ends = [self.at(min(along, math.nextafter(self.length, 0.0))) for along in self._ends]
        return [one for m, point in zip(ends, self.points) for one in (*point, *frames.to_quaternion(m))]

    def at(self, along: float) -> Matrix:
        """Return the frame at a distance (m) from the beginning, in the path's own frame: x ahead, z up.

        Beyond its ends it is at them; where it is closed, it begins again.
        """
        along = self._within(along)
        index = min(max(bisect.bisect_right(self._ends, along) - 1, 0), len(self.points) - 2)
        one, other = self.points[index], self.points[index + 1]
        piece = self._ends[index + 1] - self._ends[index]
        share = (along - self._ends[index]) / piece if piece else 0.0
        x, y, z = (a + share * (b - a) for a, b in zip(one, other))
        ahead = tuple(b - a for a, b in zip(one, other))
        return looking_along((x, y, z), (ahead[0], ahead[1], ahead[2]))

    def carried(self, along: float) -> tuple[int, list[float]]:
        """Return the flags and four numbers at a distance (m) from the beginning."""
        return 0, [0.0] * 4

    def nearest(self, place: Vector) -> float:
        """Return the distance (m) from the beginning at which the path is nearest to a place."""
        return nearest(self.points, self._ends, place)


def nearest(points: Sequence[Sequence[float]], ends: Sequence[float], place: Vector) -> float:
    """Return the distance along a line at which it is nearest to a place; `ends`: those of its points."""
    found = [(math.inf, 0.0)]
    for (begin, end), (one, other) in zip(itertools.pairwise(ends), itertools.pairwise(points)):
        piece = math.dist(one, other)
        ahead = sum((b - a) * (c - a) for a, b, c in zip(one, other, place)) / piece**2 if piece else 0.0
        share = min(max(ahead, 0.0), 1.0)
        there = [a + share * (b - a) for a, b in zip(one, other)]
        found.append((math.dist(there, place), begin + share * (end - begin)))
    return min(found)[1]


def looking_along(position: Vector, ahead: Vector) -> Matrix:
    """Return the frame at a position with x in a direction, y level and z upwards; upright where there is none."""
    x, y, z = ahead
    if not math.hypot(x, y, z):
        return frames.from_rpy(position, (0.0, 0.0, 0.0))
    level = math.hypot(x, y)
    return frames.from_rpy(position, (0.0, math.atan2(-z, level), math.atan2(y, x) if level else 0.0))
