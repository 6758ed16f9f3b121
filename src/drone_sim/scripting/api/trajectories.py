"""`sim`: trajectories that a script follows itself, with the functions of Reflexxes (3.x) and Ruckig (4.3)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

from drone_sim.mechanics.trajectory import NONE, PHASE, TIME, Limits, State, Trajectory
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import Handle, Number, Numbers, WrongValue, numbers

_MOST = 1000  # trajectories of one script
_SYNCHRONIZATION = (PHASE, TIME, PHASE, NONE)  # by the two lowest bits of the flags
LEAST_VELOCITY, LEAST_ACCELERATION = CONSTANTS["ruckig_minvel"], CONSTANTS["ruckig_minaccel"]


def synchronization(flags: int, default: str) -> str:
    """Return how degrees of freedom are synchronized; `default` if the flags are -1."""
    return default if flags < 0 else _SYNCHRONIZATION[int(flags) & 3]


class TrajectoryFunctions:
    """Trajectories with limited velocity, acceleration and jerk, which a script follows itself."""

    def __init__(self) -> None:
        self._trajectories: dict[int, Trajectory] = {}
        self._handles = itertools.count(1)

    @sim("5", rmlPos="45", RMLPos="3")
    def ruckigPos(
        self,
        dofs: int,
        _smallestTimeStep: Number,
        flags: int,
        currentPosVelAccel: Numbers,
        maxVelAccelJerk: Numbers,
        selection: Sequence[bool],
        targetPosVel: Numbers,
    ) -> int:
        """Start a trajectory of `dofs` degrees of freedom to positions and velocities; return its handle.

        Each list has `dofs` numbers of the first quantity, then of the next. `flags`: sim.ruckig_phasesync, _timesync
        (-1) or _nosync, and _minvel, _minaccel if minima follow in maxVelAccelJerk.
        """
        least = [bool(flags >= 0 and int(flags) & bit) for bit in (LEAST_VELOCITY, LEAST_ACCELERATION)]
        count = _count(dofs)
        largest = _quantities("maxVelAccelJerk", maxVelAccelJerk, count, 3 + sum(least))
        minima = iter(largest[3:])
        limits = Limits(*largest[:3], *(next(minima) if is_given else None for is_given in least))
        position, velocity = _quantities("targetPosVel", targetPosVel, count, 2)
        start = State(*_quantities("currentPosVelAccel", currentPosVelAccel, count, 3))
        sync = synchronization(flags, TIME)
        return self._add(Trajectory(start, position, velocity, limits, sync, _selected(selection, count)))

    @sim("5", rmlVel="45", RMLVel="3")
    def ruckigVel(
        self,
        dofs: int,
        _smallestTimeStep: Number,
        flags: int,
        currentPosVelAccel: Numbers,
        maxAccelJerk: Numbers,
        selection: Sequence[bool],
        targetVel: Numbers,
    ) -> int:
        """Start a trajectory of `dofs` degrees of freedom to velocities, like ruckigPos; return its handle."""
        least = bool(flags >= 0 and int(flags) & LEAST_ACCELERATION)
        count = _count(dofs)
        acceleration, jerk, *minima = _quantities("maxAccelJerk", maxAccelJerk, count, 2 + least)
        (velocity,) = _quantities("targetVel", targetVel, count, 1)
        limits = Limits([float("inf")] * count, acceleration, jerk, None, *minima)
        start = State(*_quantities("currentPosVelAccel", currentPosVelAccel, count, 3))
        sync = synchronization(flags, TIME)
        return self._add(Trajectory(start, None, velocity, limits, sync, _selected(selection, count)))

    @sim("5", rmlStep="45", RMLStep="3")
    def ruckigStep(self, handle: Handle, timeStep: Number) -> tuple[int, list[float], float]:
        """Advance a trajectory by a time in s; return 0, or 1 at its end, the state, and the time left in s.

        The state is positions, velocities and accelerations, in one list.
        """
        trajectory, (seconds,) = self._trajectory(handle), numbers((timeStep,), 1)
        if seconds <= 0:
            raise WrongValue("the time step must be greater than 0")
        state = trajectory.advance(seconds)
        return (
            int(trajectory.is_over),
            [value for quantity in state for value in quantity],
            trajectory.duration - trajectory.elapsed,
        )

    @sim("5", rmlRemove="45", RMLRemove="3")
    def ruckigRemove(self, handle: Handle) -> None:
        """Remove a trajectory."""
        self._trajectory(handle)
        del self._trajectories[handle]

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores the present trajectories and their elapsed times."""
        kept = {handle: (trajectory, trajectory.elapsed) for handle, trajectory in self._trajectories.items()}

        def restore() -> None:
            self._trajectories = {handle: trajectory for handle, (trajectory, _) in kept.items()}
            for trajectory, elapsed in kept.values():
                trajectory.elapsed = elapsed

        return restore

    def _add(self, trajectory: Trajectory) -> int:
        if len(self._trajectories) >= _MOST:
            raise ValueError(f"a script may have at most {_MOST} trajectories: remove some")
        handle = next(self._handles)
        self._trajectories[handle] = trajectory
        return handle

    def _trajectory(self, handle: int) -> Trajectory:
        if handle not in self._trajectories:
            raise ValueError(f"there is no trajectory with the handle {handle}")
        return self._trajectories[handle]


def _count(dofs: int) -> int:
    if not isinstance(dofs, (int, float)) or not 0 < dofs <= 100:
        raise WrongValue("expected 1 to 100 degrees of freedom")
    return int(dofs)


def _quantities(name: str, values: Any, count: int, quantities: int) -> list[list[float]]:
    """Return a list of `count` numbers for each quantity; surplus numbers are ignored, as in V-REP."""
    total = count * quantities
    if not isinstance(values, Sequence) or len(values) < total:
        raise WrongValue(f"{name} must have {total} numbers")
    found = numbers(values[:total], total)
    return [list(found[first : first + count]) for first in range(0, total, count)]


def _selected(selection: Any, count: int) -> list[bool]:
    if not isinstance(selection, Sequence) or len(selection) < count:
        raise WrongValue(f"selection must have {count} values")
    return [bool(value) for value in selection[:count]]
