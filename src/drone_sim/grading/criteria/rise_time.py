"""Rise time: how long a step response takes from 10 % to 90 % of the step (Ogata, Modern Control Engineering, 5-3)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from drone_sim.grading.criteria.criterion import Bound, Column, Criterion, Figure, figure
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome

_LOW, _HIGH = 0.1, 0.9


class RiseTime(Criterion):
    """A step of a column from one value to another, at `after`; times between two rows are interpolated."""

    kind: Literal["rise_time"]
    of: Column
    start: Figure | None = Field(default=None, alias="from")  # where it is at `after`, where left out
    to: Figure
    at_most: Bound  # s

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, 's')}"

    def judge(self, flown: Flown) -> Outcome:
        """Return how the flight did."""
        part = self.part(flown)
        times, values = flown.times[part], flown.columns[self.of][part]
        start = values[0] if self.start is None else self.start
        if start == self.to:
            return self.outcome(False, f"{self.of} was at {figure(self.to)} before: there is nothing to rise")
        share = (values - start) / (self.to - start)
        began, ended = crossing(times, share, _LOW), crossing(times, share, _HIGH)
        if began is None or ended is None:
            return self.outcome(False, f"never rose to 90 %: it came to {figure(100 * share.max(), '%')}")
        rise = ended - began
        passed = rise <= self.at_most
        return self.outcome(passed, f"rose in {figure(rise, 's')}; {self.allowed} are allowed", rise, "s", ended)


def crossing(times: np.ndarray, share: np.ndarray, level: float) -> float | None:
    """Return when a signal first is at a level or above it, between two rows interpolated; None for never."""
    above = np.flatnonzero(share >= level)
    if not len(above):
        return None
    index = int(above[0])
    if index == 0:
        return float(times[0])
    before, after = share[index - 1], share[index]
    return float(times[index - 1] + (level - before) / (after - before) * (times[index] - times[index - 1]))
