"""The fastest motion in several degrees of freedom within limits of velocity, acceleration and jerk.

It is computed by ruckig, as in CoppeliaSim: L. Berscheid and T. Kröger, Jerk-limited Real-time Trajectory Generation
with Arbitrary Target States, Robotics: Science and Systems, 2021. Each degree of freedom may have its own unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

PHASE, TIME, NONE = "Phase", "Time", "No"  # move in proportion, arrive together, independently
_MAX_DEGREES = 100
_TOLERANCE = 1e-9  # s; sums of steps are not exact


class State(NamedTuple):
    """Position, velocity and acceleration of each degree of freedom."""

    position: list[float]
    velocity: list[float]
    acceleration: list[float]


@dataclass(frozen=True)
class Limits:
    """Upper limits; lower limits of velocity and acceleration are the negative of these, unless stated."""

    velocity: Sequence[float]
    acceleration: Sequence[float]
    jerk: Sequence[float]
    least_velocity: Sequence[float] | None = None
    least_acceleration: Sequence[float] | None = None


class Trajectory:
    """A motion from a state to a position and a velocity, or to a velocity alone, and the time spent in it."""

    def __init__(
        self,
        start: State,
        position: Sequence[float] | None,
        velocity: Sequence[float],
        limits: Limits,
        synchronization: str = PHASE,
        selected: Sequence[bool] | None = None,
    ):
        """Compute the motion. Without `position` only `velocity` is a target.

        Degrees of freedom that are not `selected` keep their velocity. Raises ValueError if the limits allow no motion.
        """
        self._position, self._start_state, self._velocity = position, start, velocity
        self._selected = selected or [True] * len(velocity)
        if not 0 < len(velocity) <= _MAX_DEGREES:
            raise ValueError(f"1 to {_MAX_DEGREES} degrees of freedom are allowed, not {len(velocity)}")
        for limit in (limits.velocity, limits.acceleration, limits.jerk):
            if not all(value > 0 for value, is_selected in zip(limit, self._selected) if is_selected):
                raise ValueError("the limits of velocity, acceleration and jerk must be greater than 0")
        self._motion = self._compute(limits, synchronization)
        self.elapsed = 0.0  # s

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self._motion.duration)

    @property
    def is_over(self) -> bool:
        return self.elapsed >= self.duration - _TOLERANCE

    def advance(self, seconds: float) -> State:
        """Advance by `seconds`, at most to the end; return the state there."""
        self.elapsed += seconds
        state = State(*map(list, self._motion.at_time(min(self.elapsed, self.duration))))
        if self.is_over:  # exactly the target, without rounding errors
            for index, is_selected in enumerate(self._selected):
                if is_selected and self._position is not None:
                    state.position[index] = self._position[index]
                if is_selected:
                    state.velocity[index], state.acceleration[index] = self._velocity[index], 0.0
        return state

    def _compute(self, limits: Limits, synchronization: str) -> Any:
        try:
            import ruckig  # late: 1 MB that few scripts need
        except ImportError as error:
            raise ValueError(f"trajectories need ruckig (pip install ruckig): {error}") from None
        count = len(self._velocity)
        task = ruckig.InputParameter(count)
        task.control_interface = getattr(ruckig.ControlInterface, "Velocity" if self._position is None else "Position")
        task.synchronization = getattr(ruckig.Synchronization, synchronization)
        task.current_position, task.current_velocity, task.current_acceleration = map(list, self._start_state)
        task.enabled = list(self._selected)
        task.target_velocity = list(self._velocity)
        if self._position is not None:
            task.target_position = list(self._position)
        task.max_velocity, task.max_acceleration, task.max_jerk = limits.velocity, limits.acceleration, limits.jerk
        task.min_velocity, task.min_acceleration = limits.least_velocity, limits.least_acceleration
        motion = ruckig.Trajectory(count)
        try:
            ruckig.Ruckig(count).calculate(task, motion)
        except ruckig.RuckigError as error:
            reason = " ".join(str(error).split()).removeprefix("[ruckig] ").partition(" input:")[0]
            raise ValueError(f"there is no trajectory within these limits: {reason}") from None
        return motion
