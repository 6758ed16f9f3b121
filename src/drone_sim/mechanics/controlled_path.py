"""A path of V-REP 3.x, through control points, as an object of the scene; what counts for its length."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drone_sim.mechanics import frames, path_curves, path_turns
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.mechanics.scene_object import SceneObject

_NO_WAY, _NO_TURN = 5e-5, math.radians(0.01)  # m, below which V-REP takes a way, or what a turn counts, for none
# By V-REP's words (sim.distcalcmethod_...), in the order of their numbers: of a way and what its turn counts, both m.
COUNTS: dict[str, Callable[[float, float], float]] = {
    "dl": lambda way, turn: way,
    "dac": lambda way, turn: turn,
    "max_dl_dac": max,
    "dl_and_dac": lambda way, turn: way + turn,
    "sqrt_dl2_and_dac2": math.hypot,
    "dl_if_nonzero": lambda way, turn: turn if way < _NO_WAY else way,
    "dac_if_nonzero": lambda way, turn: way if turn < _NO_TURN else turn,
}
METRES_PER_RADIAN = 0.1 / math.radians(90)  # where nothing else is said
OWN, AUTOMATIC, X_UP = "own", "automatic", "x_up"


@dataclass(frozen=True)
class PathRules:
    """What holds for a whole path.

    flat: points that scripts add are at z = 0; orientation: the frames are the control points' `own`, `automatic`, or
    automatic with x up (`x_up`); counts: one of COUNTS; metres_per_radian and metres_per_pause: what a turn and a pause
    count for.
    """

    closed: bool = False
    flat: bool = False
    orientation: str = AUTOMATIC
    counts: str = "dl_if_nonzero"
    metres_per_radian: float = METRES_PER_RADIAN
    metres_per_pause: float = 1.0


class ControlledPath(Path):
    """A line through control points, any number of them; its length is what V-REP counts, in m."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix,
        points: Sequence[ControlPoint],
        rules: PathRules,
    ):
        """Take the control points, and what holds for all. What has less than three points is not closed."""
        self.control_points, self.is_flat = tuple(points), rules.flat
        stations = path_curves.line(points, rules.closed and len(points) > 2)
        closed = rules.closed and len(points) > 2 and len(stations) > 2
        if rules.orientation != OWN:
            turns = path_turns.automatic([one.position for one in stations], closed, rules.orientation == X_UP)
            stations = [one._replace(turn=turn) for one, turn in zip(stations, turns)]
        self._stations = [*stations, *stations[:closed]]
        super().__init__(names, alias, parent, local, [one.position for one in self._stations])
        self.closed = closed
        self._turns = [one.turn for one in self._stations]
        pieces = (_counted(one, other, rules) for one, other in itertools.pairwise(self._stations))
        self._ends = list(itertools.accumulate(pieces, initial=0.0))

    def at(self, along: float) -> Matrix:
        """Return the frame at a distance (m, as it counts) from the start, in the path's own. Raises ValueError."""
        station = self._station(along)
        return frames.from_quaternion(station.position, station.turn)

    def carried(self, along: float) -> tuple[int, list[float]]:
        """Return the flags and four numbers at a distance (m) from the beginning. Raises ValueError."""
        station = self._station(along)
        return station.flags, list(station.channels)

    def _station(self, along: float) -> Station:
        if not self._stations:
            raise ValueError(f"the path '{self.name}' has no points")
        if len(self._stations) == 1:
            return self._stations[0]
        along = self._within(along)
        index = min(max(bisect.bisect_left(self._ends, along) - 1, 0), len(self._stations) - 2)
        piece = self._ends[index + 1] - self._ends[index]
        share = (along - self._ends[index]) / piece if piece else 0.0
        return path_curves.between(self._stations[index], self._stations[index + 1], share)


def _counted(one: Station, other: Station, rules: PathRules) -> float:
    """Return what a piece counts for in the length, m."""
    turn = path_curves.angle_between(one.turn, other.turn) * rules.metres_per_radian
    pause = abs(other.pause - one.pause) * rules.metres_per_pause
    return COUNTS[rules.counts](math.dist(one.position, other.position), turn) + pause
