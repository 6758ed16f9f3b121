"""Timing in real time: when the next step is due, and when to publish a state. The clock is an argument."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.config.fields import ParameterField, comments, fields_of
from drone_sim.config.types import ParameterError
from drone_sim.message_text import near_names, shown
from drone_sim.run.parameters import PaceParameters, Parameters
from drone_sim.run.simulation import Simulation

_MAX_CAUGHT_UP = 0.2  # s of a delay, so that a busy machine does not slow the flight
_SLICE = 0.1  # s; long sleeps are split, so that a shutdown is noticed


class Pacer:
    """Rate of a loop, like rospy.Rate: late steps are counted, and a delay of up to 0.2 s is caught up."""

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ):
        """Start the first period now. `period` is in s of real time (0: unpaced); `clock` must be monotonic."""
        self.overruns = 0
        self.worst = 0.0  # s, the longest overrun
        self.is_late = False  # whether the present period began late
        self._period = period
        self._clock = clock
        self._sleep = sleep
        self._due = clock() + period
        self._is_excused = False

    @property
    def is_far(self) -> bool:
        """Whether the next period is so far away that a request received before would have to wait."""
        return self._due - self._clock() > _SLICE

    def change(self, period: float) -> None:
        """Change the period (s of real time; 0: unpaced), including the current one."""
        now = self._clock()
        began = self._due - self._period if self._period else now
        self._period, self._due = period, max(now, began + period)

    def wait(self, interrupted: Callable[[], bool] = lambda: False) -> float:
        """Sleep until the next period begins, or until interrupted; return the lateness in seconds.

        Due times are multiples of the period after the start, so that late wake-ups and single long steps do not add
        up. What exceeds _MAX_CAUGHT_UP is not caught up, nor is a delay that was excused.
        """
        late = max(0.0, self._clock() - self._due) if self._period else 0.0
        self._due += late if self._is_excused else max(0.0, late - _MAX_CAUGHT_UP)
        if self._is_excused:
            late, self._is_excused = 0.0, False
        self.is_late = late > 0
        if late:
            self.overruns += 1
            self.worst = max(self.worst, late)
        while self._due > self._clock() and not interrupted():
            self._sleep(min(_SLICE, max(0.0, self._due - self._clock())))
        self._due += self._period
        return late

    def excuse(self) -> None:
        """Do not count the next step as late, because something else delayed it."""
        self._is_excused, self.is_late = True, False

    def restart(self) -> None:
        """Start a new period, as after a pause: the next step is due one period from now."""
        self._due, self.is_late = self._clock() + self._period, False


class Throttle:
    """Limit of an action to once per period."""

    def __init__(self, period: float, clock: Callable[[], float] = time.monotonic):
        """`period` is in s of real time; `clock` must be monotonic."""
        self._period = period
        self._clock = clock
        self._next = -math.inf

    def passes(self) -> bool:
        """Return whether the action may happen now; if so, a new period begins."""
        now = self._clock()
        if now < self._next:
            return False
        self._next = now + self._period
        return True


class Beat:
    """Rate limit for publishing a state: period `soon` after a change, period `seldom` without a change."""

    def __init__(self, soon: float, seldom: float, clock: Callable[[], float] = time.monotonic):
        """Both periods are in s of real time; `clock` must be monotonic."""
        self._soon, self._seldom = soon, seldom
        self._clock = clock
        self.restart()

    def left(self, changed: bool) -> float:
        """Return the time in s until the state is due, 0 if it is due now."""
        return max(0.0, self._last + (self._soon if changed else self._seldom) - self._clock())

    def restart(self) -> None:
        """Start a new period, after the state was published."""
        self._last = self._clock()


FACTOR = "real_time_factor"


def period(parameters: Parameters) -> float:
    """Return the period of the steps in s of real time, 0 if they are unpaced."""
    factor = parameters.real_time_factor
    return parameters.time_step / factor if factor else 0.0


class Pace:
    """Real-time factor of a simulation. A change applies from the next step on, and persists across starts."""

    def __init__(self, simulation: Simulation, pacer: Pacer):
        """`pacer` times the steps of `simulation`."""
        self._simulation, self._pacer = simulation, pacer
        text = comments()[FACTOR]
        self.known: dict[str, ParameterField] = {
            leaf.name: leaf._replace(description=text) for leaf in fields_of(PaceParameters)
        }

    def values(self) -> dict[str, Any]:
        return {FACTOR: self._simulation.parameters.real_time_factor}

    def change(self, changes: Mapping[str, Any]) -> None:
        """Change the real-time factor. Raises ParameterError."""
        for name in changes.keys() - self.known.keys():
            near = near_names(name[:80], self.known)
            raise ParameterError(f"cannot be changed while the simulation runs; {near}", (shown(name),))
        if changes:
            self._simulation.set_pace(changes[FACTOR])
            self._pacer.change(period(self._simulation.parameters))
