"""Paths as objects of the scene: through points, and V-REP 3.x's through control points, measured as there.

Metres, in the path's frame unless stated otherwise.
"""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drone_sim.mechanics import frames, path_curves
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.mechanics.scene_object import SceneObject

_MIN_DISTANCE, _MIN_ROTATION = 5e-5, math.radians(0.01)  # m; less counts as zero in V-REP
# Length of a segment from its distance and its rotation (all in m), by V-REP's sim.distcalcmethod_..., in their order.
COUNTS: dict[str, Callable[[float, float], float]] = {
    "dl": lambda distance, rotation: distance,
    "dac": lambda distance, rotation: rotation,
    "max_dl_dac": max,
    "dl_and_dac": lambda distance, rotation: distance + rotation,
    "sqrt_dl2_and_dac2": math.hypot,
    "dl_if_nonzero": lambda distance, rotation: rotation if distance < _MIN_DISTANCE else distance,
    "dac_if_nonzero": lambda distance, rotation: distance if rotation < _MIN_ROTATION else rotation,
}
METRES_PER_RADIAN = 0.1 / math.radians(90)  # default
OWN, AUTOMATIC, X_UP = "own", "automatic", "x_up"


class Path(SceneObject):
    """A path of straight segments between points."""

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
        """Create a path through at least two points (m); if `closed`, it leads from the last point back to the first.

        `turns` are the points' orientations (quaternions x, y, z, w); without them the points look along the path.
        """
        super().__init__(names, alias, parent, local, kind="path")
        self.points: list[Vector] = [(x, y, z) for x, y, z in points]
        self.closed = closed
        if closed and self.points[0] != self.points[-1]:
            self.points.append(self.points[0])
        self._turns = [*turns, turns[0]][: len(self.points)] if turns else []
        self._position_along = 0.0
        lengths = (math.dist(start, end) for start, end in itertools.pairwise(self.points))
        self._distances = list(itertools.accumulate(lengths, initial=0.0))  # of each point from the beginning, m

    @property
    def length(self) -> float:
        """Length in m."""
        return self._distances[-1]

    @property
    def position_along(self) -> float:
        """Position (m) of a follower, as in V-REP 3.x: limited to the path's ends, or wrapped around if closed."""
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
        """The points as CoppeliaSim 4.x keeps them in an object's data PATH: x, y, z, and quaternion x, y, z, w."""
        if self._turns or not self.points:
            return [number for point, orientation in zip(self.points, self._turns) for number in (*point, *orientation)]
        matrices = [self.at(min(along, math.nextafter(self.length, 0.0))) for along in self._distances]
        return [number for m, point in zip(matrices, self.points) for number in (*point, *frames.to_quaternion(m))]

    def at(self, along: float) -> Matrix:
        """Return the frame at a distance (m) from the beginning, in the path's frame: x ahead, z up.

        Distances beyond the ends count as the ends; on a closed path they wrap around.
        """
        along = self._within(along)
        index = min(max(bisect.bisect_right(self._distances, along) - 1, 0), len(self.points) - 2)
        start, end = self.points[index], self.points[index + 1]
        length = self._distances[index + 1] - self._distances[index]
        fraction = (along - self._distances[index]) / length if length else 0.0
        x, y, z = (a + fraction * (b - a) for a, b in zip(start, end))
        direction = tuple(b - a for a, b in zip(start, end))
        return looking_along((x, y, z), (direction[0], direction[1], direction[2]))

    def carried(self, along: float) -> tuple[int, list[float]]:
        """Return the flags and the four channels at a distance (m) from the beginning: all 0 here."""
        return 0, [0.0] * 4

    def nearest(self, place: Vector) -> float:
        """Return the distance (m) from the beginning to the path's point that is nearest to `place`."""
        return nearest(self.points, self._distances, place)


def nearest(points: Sequence[Sequence[float]], ends: Sequence[float], place: Vector) -> float:
    """Return the distance along a line to its point nearest to `place`; `ends` are the distances of its `points`."""
    candidates = [(math.inf, 0.0)]
    for (start_distance, end_distance), (start, end) in zip(itertools.pairwise(ends), itertools.pairwise(points)):
        length = math.dist(start, end)
        projection = sum((b - a) * (c - a) for a, b, c in zip(start, end, place)) / length**2 if length else 0.0
        fraction = min(max(projection, 0.0), 1.0)
        point = [a + fraction * (b - a) for a, b in zip(start, end)]
        candidates.append((math.dist(point, place), start_distance + fraction * (end_distance - start_distance)))
    return min(candidates)[1]


def looking_along(position: Vector, ahead: Vector) -> Matrix:
    """Return the frame at `position` with x along `ahead`, y level, z upwards; not rotated if `ahead` is zero."""
    x, y, z = ahead
    if not math.hypot(x, y, z):
        return frames.from_rpy(position, (0.0, 0.0, 0.0))
    level = math.hypot(x, y)
    return frames.from_rpy(position, (0.0, math.atan2(-z, level), math.atan2(y, x) if level else 0.0))


# ---- paths through control points


@dataclass(frozen=True)
class PathRules:
    """Settings of a path.

    flat: points that scripts add are at z = 0; orientation: the frames are the control points' `own`, `automatic`, or
    automatic with x up (`x_up`); counts: one of COUNTS; metres_per_radian, metres_per_pause: the length that a rotation
    and a pause count for.
    """

    closed: bool = False
    flat: bool = False
    orientation: str = AUTOMATIC
    counts: str = "dl_if_nonzero"
    metres_per_radian: float = METRES_PER_RADIAN
    metres_per_pause: float = 1.0


class ControlledPath(Path):
    """A path through any number of control points; its length (m) is measured as in V-REP."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix,
        points: Sequence[ControlPoint],
        rules: PathRules,
    ):
        """Create the path; with less than three points it is not closed."""
        self.control_points, self.is_flat = tuple(points), rules.flat
        stations = path_curves.line(points, rules.closed and len(points) > 2)
        closed = rules.closed and len(points) > 2 and len(stations) > 2
        if rules.orientation != OWN:
            turns = path_curves.automatic_turns(
                [station.position for station in stations], closed, rules.orientation == X_UP
            )
            stations = [station._replace(turn=turn) for station, turn in zip(stations, turns)]
        self._stations = [*stations, *stations[:closed]]
        super().__init__(names, alias, parent, local, [station.position for station in self._stations])
        self.closed = closed
        self._turns = [station.turn for station in self._stations]
        lengths = []
        for start, end in itertools.pairwise(self._stations):
            distance = math.dist(start.position, end.position)
            rotation = path_curves.angle_between(start.turn, end.turn) * rules.metres_per_radian
            pause = abs(end.pause - start.pause) * rules.metres_per_pause
            lengths.append(COUNTS[rules.counts](distance, rotation) + pause)
        self._distances = list(itertools.accumulate(lengths, initial=0.0))

    def at(self, along: float) -> Matrix:
        """Return the frame, in the path's, at a measured distance (m). Raises ValueError for a path without points."""
        station = self._station(along)
        return frames.from_quaternion(station.position, station.turn)

    def carried(self, along: float) -> tuple[int, list[float]]:
        """Return flags and four channels at a measured distance (m). Raises ValueError for a path without points."""
        station = self._station(along)
        return station.flags, list(station.channels)

    def _station(self, along: float) -> Station:
        if not self._stations:
            raise ValueError(f"the path '{self.name}' has no points")
        if len(self._stations) == 1:
            return self._stations[0]
        along = self._within(along)
        index = min(max(bisect.bisect_left(self._distances, along) - 1, 0), len(self._stations) - 2)
        length = self._distances[index + 1] - self._distances[index]
        fraction = (along - self._distances[index]) / length if length else 0.0
        return path_curves.between(self._stations[index], self._stations[index + 1], fraction)
