"""The simulation's clock."""

from __future__ import annotations


class Clock:
    """Simulation clock. It counts steps instead of adding up seconds, so it does not drift."""

    def __init__(self, time_step: float):
        """Start at time 0; `time_step` in s."""
        self.time_step = time_step
        self.steps = 0
        self.is_sensing = False

    @property
    def time(self) -> float:
        """Simulated time in s."""
        return self.steps * self.time_step

    @property
    def script_time(self) -> float:
        """Time (s) that scripts see. As in V-REP, it advances at the end of a step, after the sensing phase."""
        return (self.steps - self.is_sensing) * self.time_step
