"""`sim`: trajectories that a script follows by itself: the functions of Reflexxes (3.x) and of Ruckig (4.3)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

from drone_sim.mechanics.trajectory import NONE, PHASE, TIME, Limits, State, Trajectory
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import Handle, Number, Numbers, WrongValue, numbers

_MOST = 1000  # of one script
_SYNCHRONIZATION = (PHASE, TIME, PHASE, NONE)  # by the lowest two bits of the flags
LEAST_VELOCITY, LEAST_ACCELERATION = CONSTANTS["ruckig_minvel"], CONSTANTS["ruckig_minaccel"]


def synchronization(flags: int, default: str) -> str:
    """Return how degrees of freedom go together; `default` where the flags are -1."""
    return default if flags < 0 else _SYNCHRONIZATION[int(flags) & 3]


class TrajectoryFunctions:
    """Trajectories within limits of velocity, acceleration and jerk, which a script follows by itself."""

    def __init__(self) -> None:
        """Start with none."""
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
        """Begin a trajectory of `dofs` degrees of freedom to positions and velocities; return its handle.

        Each list has `dofs` numbers of each, one kind after the other. `flags`: sim.ruckig_phasesync, _timesync (-1) or
        _nosync, and _minvel, _minaccel where the least of these stand behind the others of maxVelAccelJerk.
        """
        least = [bool(flags >= 0 and int(flags) & bit) for bit in (LEAST_VELOCITY, LEAST_ACCELERATION)]
        count = _count(dofs)
        most = _kinds("maxVelAccelJerk", maxVelAccelJerk, count, 3 + sum(least))
        given = iter(most[3:])
        limits = Limits(*most[:3], *(next(given) if one else None for one in least))
        position, velocity = _kinds("targetPosVel", targetPosVel, count, 2)
        start = State(*_kinds("currentPosVelAccel", currentPosVelAccel, count, 3))
        way = synchronization(flags, TIME)
        return self._begin(Trajectory(start, position, velocity, limits, way, _selected(selection, count)))

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
        """Begin a trajectory of `dofs` degrees of freedom to velocities; return its handle. As ruckigPos."""
        least = bool(flags >= 0 and int(flags) & LEAST_ACCELERATION)
        count = _count(dofs)
        acceleration, jerk, *more = _kinds("maxAccelJerk", maxAccelJerk, count, 2 + least)
        (velocity,) = _kinds("targetVel", targetVel, count, 1)
        limits = Limits([float("inf")] * count, acceleration, jerk, None, *more)
        start = State(*_kinds("currentPosVelAccel", currentPosVelAccel, count, 3))
        way = synchronization(flags, TIME)
        return self._begin(Trajectory(start, None, velocity, limits, way, _selected(selection, count)))

    @sim("5", rmlStep="45", RMLStep="3")
    def ruckigStep(self, handle: Handle, timeStep: Number) -> tuple[int, list[float], float]:
        """Go on along a trajectory for so many seconds; return 0, or 1 at its end, the state there, and what is left.

        The state is positions, velocities, accelerations, in one list; what is left is in s.
        """
        trajectory, (seconds,) = self._trajectory(handle), numbers((timeStep,), 1)
        if seconds <= 0:
            raise WrongValue("the time step must be greater than 0")
        state = trajectory.advance(seconds)
        return (
            int(trajectory.is_over),
            [one for kind in state for one in kind],
            trajectory.duration - trajectory.elapsed,
        )

    @sim("5", rmlRemove="45", RMLRemove="3")
    def ruckigRemove(self, handle: Handle) -> None:
        """Forget a trajectory."""
        self._trajectory(handle)
        del self._trajectories[handle]

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back how far along each trajectory the script is."""
        kept = {handle: (one, one.elapsed) for handle, one in self._trajectories.items()}

        def restore() -> None:
            self._trajectories = {handle: one for handle, (one, _) in kept.items()}
            for one, elapsed in kept.values():
                one.elapsed = elapsed

        return restore

    def _begin(self, trajectory: Trajectory) -> int:
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


def _kinds(name: str, values: Any, count: int, kinds: int) -> list[list[float]]:
    """Return so many lists of `count` numbers each; what is behind them is ignored, as by V-REP."""
    if not isinstance(values, Sequence) or len(values) < count * kinds:
        raise WrongValue(f"{name} must have {count * kinds} numbers")
    found = numbers(values[: count * kinds], count * kinds)
    return [list(found[first : first + count]) for first in range(0, count * kinds, count)]


def _selected(selection: Any, count: int) -> list[bool]:
    if not isinstance(selection, Sequence) or len(selection) < count:
        raise WrongValue(f"selection must have {count} values")
    return [bool(one) for one in selection[:count]]
