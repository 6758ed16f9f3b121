"""Keep simulated time beside real time: without drift, without bursts. The clock is an argument."""

from __future__ import annotations

import time
from typing import Callable

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
        self._period = period
        self._clock = clock
        self._sleep = sleep
        self.restart()

    def wait(self, interrupted: Callable[[], bool] = lambda: False) -> float:
        """Sleep until the next period begins, or until interrupted; return the lateness in seconds.

        Due times are multiples of the period after the start, so a late wake-up does not add up. When
        a step took longer than its period, the following ones are put off by as much.
        """
        late = max(0.0, self._clock() - self._due) if self._period else 0.0
        if late:
            self.overruns += 1
            self._due += late
        while self._due > self._clock() and not interrupted():
            self._sleep(min(_SLICE, max(0.0, self._due - self._clock())))
        self._due += self._period
        return late

    def restart(self) -> None:
        """Begin to count anew, as after a pause: the next step is due one period from now."""
        self._due = self._clock() + self._period
