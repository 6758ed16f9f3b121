"""A motion in several degrees of freedom within limits of velocity, acceleration and jerk, as short as these let it be.

ruckig finds it, as it does for CoppeliaSim: L. Berscheid and T. Kröger, Jerk-limited Real-time Trajectory Generation
with Arbitrary Target States, Robotics: Science and Systems, 2021. Each number is one degree of freedom's, in whatever
unit that has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

PHASE, TIME, NONE = "Phase", "Time", "No"  # degrees of freedom stay in proportion, arrive together, or each for itself
_MOST_DEGREES = 100
_SOON = 1e-9  # s: sums of steps are not exact


class State(NamedTuple):
    """Where it is, and how it moves there."""

    position: list[float]
    velocity: list[float]
    acceleration: list[float]


@dataclass(frozen=True)
class Limits:
    """Upper limits; the lower ones of velocity and acceleration are the negative of these, unless given."""

    velocity: Sequence[float]
    acceleration: Sequence[float]
    jerk: Sequence[float]
    least_velocity: Sequence[float] | None = None
    least_acceleration: Sequence[float] | None = None


class Trajectory:
    """From one state to a position and a velocity, or to a velocity alone; and how far along it somebody is."""

    def __init__(
        self,
        start: State,
        position: Sequence[float] | None,
        velocity: Sequence[float],
        limits: Limits,
        synchronization: str = PHASE,
        selected: Sequence[bool] | None = None,
    ):
        """Without a `position` only `velocity` is to be reached; what is not `selected` keeps its velocity.

        Raises ValueError for limits within which there is none.
        """
        self._goal, self._start, self._velocity = position, start, velocity
        self._selected = selected or [True] * len(velocity)
        if not 0 < len(velocity) <= _MOST_DEGREES:
            raise ValueError(f"1 to {_MOST_DEGREES} degrees of freedom are expected, not {len(velocity)}")
        for most in (limits.velocity, limits.acceleration, limits.jerk):
            if not all(one > 0 for one, taken in zip(most, self._selected) if taken):
                raise ValueError("the limits of velocity, acceleration and jerk must be greater than 0")
        self._found = self._compute(limits, synchronization)
        self.elapsed = 0.0  # s

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return float(self._found.duration)

    @property
    def is_over(self) -> bool:
        """Whether its end is reached."""
        return self.elapsed >= self.duration - _SOON

    def advance(self, seconds: float) -> State:
        """Go on for so long, at most to the end; return the state there."""
        self.elapsed += seconds
        state = State(*map(list, self._found.at_time(min(self.elapsed, self.duration))))
        if self.is_over:  # exactly there, whatever was lost in sums
            for index, taken in enumerate(self._selected):
                if taken and self._goal is not None:
                    state.position[index] = self._goal[index]
                if taken:
                    state.velocity[index], state.acceleration[index] = self._velocity[index], 0.0
        return state

    def _compute(self, limits: Limits, synchronization: str) -> Any:
        try:
            import ruckig  # 1 MB that few scripts need
        except ImportError as error:
            raise ValueError(f"trajectories need ruckig (pip install ruckig): {error}") from None
        count = len(self._velocity)
        given = ruckig.InputParameter(count)
        given.control_interface = getattr(ruckig.ControlInterface, "Velocity" if self._goal is None else "Position")
        given.synchronization = getattr(ruckig.Synchronization, synchronization)
        given.current_position, given.current_velocity, given.current_acceleration = map(list, self._start)
        given.enabled = list(self._selected)
        given.target_velocity = list(self._velocity)
        if self._goal is not None:
            given.target_position = list(self._goal)
        given.max_velocity, given.max_acceleration, given.max_jerk = limits.velocity, limits.acceleration, limits.jerk
        given.min_velocity, given.min_acceleration = limits.least_velocity, limits.least_acceleration
        found = ruckig.Trajectory(count)
        try:
            ruckig.Ruckig(count).calculate(given, found)
        except ruckig.RuckigError as error:
            said = " ".join(str(error).split()).removeprefix("[ruckig] ").partition(" input:")[0]
            raise ValueError(f"ruckig finds no trajectory within these limits: {said}") from None
        return found
