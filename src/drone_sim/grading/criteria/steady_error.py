"""Steady error: how far the mean of a column is from its target value, after it has had time to settle.

The steady-state error is the limit for t to infinity (Ogata, Modern Control Engineering, 5th ed., section 5-8); a
flight ends, so here it is computed from the mean over the last part.
"""

from __future__ import annotations

from typing import Annotated, Literal

from drone_sim.config.types import Finite, Within
from drone_sim.grading.criteria.criterion import Bound, Column, Criterion, Figure, FlightPart, figure
from drone_sim.grading.flight_record import UNITS
from drone_sim.grading.result import Outcome


class SteadyError(Criterion):
    """`to` and `at_most` are in the unit of the column; the mean is over the last `over` s of its part."""

    kind: Literal["steady_error"]
    of: Column
    to: Figure
    at_most: Bound
    over: Annotated[Finite, Within(1e-3, 1e6)] = 1.0

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, UNITS[self.of])}"

    def _judged(self, part: FlightPart) -> Outcome:
        unit = UNITS[self.of]
        last = part.rows & (part.flight.times >= part.end - self.over - 1e-9)
        mean = float(part._replace(rows=last).column(self.of).mean())
        error = abs(mean - self.to)
        said = (
            f"{self.of} was {figure(mean, unit)} in the mean, {figure(error, unit)} from {figure(self.to, unit)}; "
            f"{self.allowed} is allowed"
        )
        return self._outcome(error <= self.at_most, said, error, unit)
