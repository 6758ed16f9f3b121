"""A V-REP 3.x path through control points, as an object of the scene, and how V-REP measures its length."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drone_sim.mechanics import frames, path_curves
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import Path
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
        lengths = (_length_of_segment(start, end, rules) for start, end in itertools.pairwise(self._stations))
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


def _length_of_segment(start: Station, end: Station, rules: PathRules) -> float:
    """Return the length of a segment (m), as the rules measure it."""
    rotation = path_curves.angle_between(start.turn, end.turn) * rules.metres_per_radian
    pause = abs(end.pause - start.pause) * rules.metres_per_pause
    return COUNTS[rules.counts](math.dist(start.position, end.position), rotation) + pause
