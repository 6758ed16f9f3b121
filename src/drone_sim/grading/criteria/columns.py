"""Criteria of one column: its bounds, its mean, the tilt of the vehicle, and the response to a step.

A step response is the column after its target has changed from one value to another. Its definitions, and that of the
steady-state error, are those of Ogata, Modern Control Engineering, 5th ed., sections 5-3 and 5-8.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from drone_sim.config.types import Finite, ParameterError, Within
from drone_sim.grading.criteria.criterion import (
    ROUNDING,
    AtMostCriterion,
    Bound,
    Column,
    Criterion,
    CriterionFailed,
    Figure,
    FlightPart,
    Hint,
    format_figure,
)
from drone_sim.grading.flight_record import UNITS
from drone_sim.grading.result import Outcome

_LOW, _HIGH = 0.1, 0.9  # shares of the step, between which the rise time is measured


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

    The steady-state error is the limit for t to infinity; a flight ends, so the mean over its last part stands for the
    limit.
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


# ---- step response


class Response(NamedTuple):
    """A step response scaled to rise from 0 to 1, linear between two rows."""

    times: np.ndarray  # (M,) in s
    shares: np.ndarray  # (M,) shares of the step

    def crossing(self, level: float) -> float | None:
        """Return the time (s) at which the response first reaches a level; None if it never does."""
        beyond = np.flatnonzero(self.shares >= level)
        if not len(beyond):
            return None
        index = int(beyond[0])
        return self.interpolate(index - 1, level) if index else float(self.times[0])

    def interpolate(self, index: int, level: float) -> float:
        """Return the time (s) between the rows `index` and `index + 1` at which the response is at a level."""
        (first, second), (before, after) = self.times[index : index + 2], self.shares[index : index + 2]
        return float(first + (level - before) / (after - before) * (second - first))


class StepCriterion(AtMostCriterion):
    """A criterion of a column that steps at the time `after`, `from` one value `to` another."""

    of: Column
    start: Figure | None = Field(default=None, alias="from")  # the default is the value at `after`
    to: Figure

    unit = "s"

    def model_post_init(self, context: Any) -> None:
        """Refuse a step of height 0."""
        super().model_post_init(context)
        if self.start == self.to:
            raise ParameterError("is the same as `from`: there would be no step", ("to",), f"{self.to:g}")

    def response(self, part: FlightPart) -> Response:
        """Return the response in a part of the flight. Raises CriterionFailed."""
        values = part.column(self.of)
        start = values[0] if self.start is None else self.start
        if start == self.to:
            at = format_figure(self.to, UNITS[self.of])
            raise CriterionFailed(f"{self.of} was at {at} before: there was no step")
        return Response(part.times, (values - start) / (self.to - start))


class RiseTime(StepCriterion):
    """The time in s from 10 % to 90 % of the step, Ogata's for overdamped systems and that of MATLAB's stepinfo.

    For a first-order lag it is ln 9 = 2.197 time constants. What the response does later does not matter.
    """

    kind: Literal["rise_time"]
    hint: Hint = "Raise the gain of this loop: it answers too slowly."

    is_lasting = False

    def _judge_part(self, part: FlightPart) -> Outcome:
        response = self.response(part)
        began, ended = response.crossing(_LOW), response.crossing(_HIGH)
        if began is None or ended is None:
            highest = format_figure(100 * float(response.shares.max()), "%")
            return self.fail(f"never rose to 90 % of the step, but to {highest}")
        return self._compare(ended - began, f"rose in {format_figure(ended - began, 's')}", ended)


class Overshoot(StepCriterion):
    """The maximum overshoot in percent of the step; a response that does not rise to 90 % fails.

    For a second-order system with the damping ratio d it is 100 exp(-pi d / sqrt(1 - d²)).
    """

    kind: Literal["overshoot"]
    hint: Hint = "Add damping to this loop, or lower its gain."

    unit = "%"

    def _judge_part(self, part: FlightPart) -> Outcome:
        times, shares = self.response(part)
        peak = int(shares.argmax())
        if shares[peak] < _HIGH:
            highest = format_figure(100 * float(shares[peak]), "%")
            raise CriterionFailed(f"came to {highest} of the step: there was nothing to overshoot")
        overshoot = 100 * max(0.0, float(shares[peak]) - 1)
        at = float(times[peak]) if overshoot else None
        return self._compare(overshoot, f"went {format_figure(overshoot, '%')} beyond", at)


class SettlingTime(StepCriterion):
    """The time in s after the step until the response stays within `band`, a share of the step, about its target.

    For a first-order lag it is -ln(band) time constants: 3.912 for 2 %.
    """

    kind: Literal["settling_time"]
    hint: Hint = "Add damping to this loop, so that it swings less."
    band: Annotated[Finite, Within(1e-6, 1)] = 0.02

    def _judge_part(self, part: FlightPart) -> Outcome:
        response = self.response(part)
        band = format_figure(100 * self.band, "%")
        outside = np.flatnonzero(np.abs(response.shares - 1) > self.band)
        last = int(outside[-1]) if len(outside) else -1
        if last == len(response.shares) - 1:
            error = format_figure(100 * abs(float(response.shares[-1]) - 1), "%")
            return self.fail(f"did not settle within {band}: at the end it was {error} of the step away")
        edge = 1 + self.band if last >= 0 and response.shares[last] > 1 else 1 - self.band
        settled = float(response.times[0]) if last < 0 else response.interpolate(last, edge)
        duration = settled - self.after
        return self._compare(duration, f"settled within {band} in {format_figure(duration, 's')}", settled)
