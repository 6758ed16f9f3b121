"""Criteria of one column: its bounds, its mean, and the tilt of the vehicle."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np

from drone_sim.config.types import Finite, ParameterError, Within
from drone_sim.grading.criteria.criterion import (
    ROUNDING,
    AtMostCriterion,
    Bound,
    Column,
    Criterion,
    Figure,
    FlightPart,
    Hint,
    format_figure,
)
from drone_sim.grading.flight_record import UNITS
from drone_sim.grading.result import Outcome


class Stays(Criterion):
    """A column stays between `at_least` and `at_most`, in the column's unit; one of them may be left out."""

    kind: Literal["stays"]
    hint: Hint = "Look at the curve: if it swings, lower the gain or add damping; if it creeps, raise the gain."
    of: Column
    at_least: Figure | None = None
    at_most: Figure | None = None

    def model_post_init(self, context: Any) -> None:
        """Refuse bounds that every value, or no value, satisfies."""
        super().model_post_init(context)
        if self.at_least is None and self.at_most is None:
            raise ParameterError("missing; there must be an `at_least`, an `at_most`, or both", ("at_most",))
        if self.at_least is not None and self.at_most is not None and self.at_most < self.at_least:
            reason = f"must not be less than at_least = {self.at_least:g}"
            raise ParameterError(reason, ("at_most",), f"{self.at_most:g}")

    @property
    def allowed(self) -> str:
        bounds = (("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(
            f"{word} {format_figure(bound, UNITS[self.of])}" for word, bound in bounds if bound is not None
        )

    def _judge_part(self, part: FlightPart) -> Outcome:
        values, unit = part.column(self.of), UNITS[self.of]
        below = np.full_like(values, -np.inf) if self.at_least is None else self.at_least - values
        above = np.full_like(values, -np.inf) if self.at_most is None else values - self.at_most
        excess = np.maximum(below, above)
        worst = int(excess.argmax())
        span = f"from {format_figure(values.min(), unit)} to {format_figure(values.max(), unit)}"
        sentence = f"{self.of} was {span}; {self.allowed} is allowed"
        return self._make_outcome(excess[worst] <= 0, sentence, float(values[worst]), unit, float(part.times[worst]))


class SteadyError(Criterion):
    """The mean of a column over the last `over` s of its part is at most `at_most` away from `to`.

    Ogata, Modern Control Engineering, 5th ed., section 5-8, defines the steady-state error as the limit for t to
    infinity; a flight ends, so the mean over its last part stands for the limit.
    """

    kind: Literal["steady_error"]
    hint: Hint = "What stays must be integrated away, or needs a higher gain."
    of: Column
    to: Figure
    at_most: Bound
    over: Annotated[Finite, Within(1e-3, 1e6)] = 1.0

    @property
    def allowed(self) -> str:
        return f"at most {format_figure(self.at_most, UNITS[self.of])}"

    def _judge_part(self, part: FlightPart) -> Outcome:
        unit = UNITS[self.of]
        last_rows = part.rows & (part.flight.times >= part.end - self.over - ROUNDING)
        mean = float(part._replace(rows=last_rows).column(self.of).mean())
        error = abs(mean - self.to)
        sentence = (
            f"{self.of} was {format_figure(mean, unit)} in the mean, {format_figure(error, unit)} from "
            f"{format_figure(self.to, unit)}; {self.allowed} is allowed"
        )
        return self._make_outcome(error <= self.at_most, sentence, error, unit)


class Attitude(AtMostCriterion):
    """The largest angle (rad) between the vehicle's vertical axis and the world's, in any direction."""

    kind: Literal["attitude"]
    hint: Hint = "Limit the speed that you command, or change it more slowly."
    at_most: Annotated[Finite, Within(0, 3.2)]

    unit = "rad"

    def _judge_part(self, part: FlightPart) -> Outcome:
        tilt = part.column("tilt")
        worst = int(tilt.argmax())
        angle, at = float(tilt[worst]), float(part.times[worst])
        return self._compare(angle, f"leaned by {format_figure(angle, 'rad')} at {at:.2f} s", at)
