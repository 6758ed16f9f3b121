"""The simulation's clock."""

from __future__ import annotations


class Clock:
    """Counts steps, and sums no seconds, so that it does not drift."""

    def __init__(self, time_step: float):
        """Begin at time 0; `time_step` in s."""
        self.time_step = time_step
        self.steps = 0

    @property
    def time(self) -> float:
        """Simulated time in s."""
        return self.steps * self.time_step
