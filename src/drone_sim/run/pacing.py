"""When the next step is due, at which pace, and when it is time to show something. The clock is an argument."""

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

_SLICE = 0.1  # s; a long sleep is cut so that a shutdown is noticed


class Pacer:
    """Lets a loop pass once per period. A step that comes too late is counted, never caught up."""

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ):
        """Take the period in real seconds (0: as fast as it can), a monotonic clock, and a sleep."""
        self.overruns = 0
        self.worst = 0.0  # s, of the overruns
        self._period = period
        self._clock = clock
        self._sleep = sleep
        self._due = clock() + period
        self._excused = False

    @property
    def is_far(self) -> bool:
        """Whether the next period begins so late that a request that comes meanwhile would have to wait."""
        return self._due - self._clock() > _SLICE

    def change(self, period: float) -> None:
        """Let the periods be others (real seconds; 0: as fast as it can), the one that has begun too."""
        now = self._clock()
        begun = self._due - self._period if self._period else now
        self._period, self._due = period, max(now, begun + period)

    def wait(self, interrupted: Callable[[], bool] = lambda: False) -> float:
        """Sleep until the next period begins, or until interrupted; return the lateness in seconds.

        Due times are multiples of the period after the start, so a late wake-up does not add up. When
        a step took longer than its period, the following ones are put off by as much.
        """
        late = max(0.0, self._clock() - self._due) if self._period else 0.0
        self._due += late
        if self._excused:
            late, self._excused = 0.0, False
        if late:
            self.overruns += 1
            self.worst = max(self.worst, late)
        while self._due > self._clock() and not interrupted():
            self._sleep(min(_SLICE, max(0.0, self._due - self._clock())))
        self._due += self._period
        return late

    def excuse(self) -> None:
        """Let the next step not count as late: others have held it up."""
        self._excused = True

    def restart(self) -> None:
        """Begin to count anew, as after a pause: the next step is due one period from now."""
        self._due = self._clock() + self._period


class Throttle:
    """Lets something pass, but not more often than once per period."""

    def __init__(self, period: float, clock: Callable[[], float] = time.monotonic):
        """Take the period in real seconds, and a monotonic clock."""
        self._period = period
        self._clock = clock
        self._next = -math.inf

    def passes(self) -> bool:
        """Tell whether it may pass now; it counts as passed then."""
        now = self._clock()
        if now < self._next:
            return False
        self._next = now + self._period
        return True


class Beat:
    """Says when to show a state again: soon after a change, but not too often, and seldom without a change."""

    def __init__(self, soon: float, seldom: float, clock: Callable[[], float] = time.monotonic):
        """Take both periods in real seconds, and a monotonic clock."""
        self._soon, self._seldom = soon, seldom
        self._clock = clock
        self.restart()

    def left(self, changed: bool) -> float:
        """Return the seconds until it is time: 0 when it is."""
        return max(0.0, self._last + (self._soon if changed else self._seldom) - self._clock())

    def restart(self) -> None:
        """Count from now: it has been shown."""
        self._last = self._clock()


FACTOR = "real_time_factor"


def period(parameters: Parameters) -> float:
    """Return the real seconds from one step to the next, 0 where they come as fast as they can."""
    factor = parameters.real_time_factor
    return parameters.time_step / factor if factor else 0.0


class Pace:
    """The pace of one simulation. It holds from the step that is waited for, through every start."""

    def __init__(self, simulation: Simulation, pacer: Pacer):
        """Take the simulation, and what lets its steps pass."""
        self._simulation, self._pacer = simulation, pacer
        said = comments()[FACTOR]
        self.known: dict[str, ParameterField] = {one.name: one._replace(said=said) for one in fields_of(PaceParameters)}

    def values(self) -> dict[str, Any]:
        """Return what holds now, by name."""
        return {FACTOR: self._simulation.parameters.real_time_factor}

    def change(self, changes: Mapping[str, Any]) -> None:
        """Let another factor hold. Raises ParameterError."""
        for name in changes.keys() - self.known.keys():
            near = near_names(name[:80], self.known)
            raise ParameterError(f"cannot be changed while the simulation runs; {near}", (shown(name),))
        if changes:
            self._simulation.set_pace(changes[FACTOR])
            self._pacer.change(period(self._simulation.parameters))
