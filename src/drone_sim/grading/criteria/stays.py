"""Stays: a column keeps within bounds."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.grading.criteria.criterion import Column, Criterion, Figure, FlightPart, figure
from drone_sim.grading.flight_record import UNITS
from drone_sim.grading.result import Outcome


class Stays(Criterion):
    """`at_least` and `at_most` are in the unit of the column; one of them may be left out."""

    kind: Literal["stays"]
    of: Column
    at_least: Figure | None = None
    at_most: Figure | None = None

    def model_post_init(self, context: Any) -> None:
        """Refuse bounds that every value, or no value, satisfies."""
        super().model_post_init(context)
        if self.at_least is None and self.at_most is None:
            raise ParameterError("missing; there must be an `at_least`, an `at_most`, or both", ("at_most",))
        if self.at_least is not None and self.at_most is not None and self.at_most < self.at_least:
            raise ParameterError(
                f"must not be less than at_least = {self.at_least:g}", ("at_most",), f"{self.at_most:g}"
            )

    @property
    def allowed(self) -> str:
        """What passes."""
        bounds = (("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(f"{word} {figure(one, UNITS[self.of])}" for word, one in bounds if one is not None)

    def _judged(self, part: FlightPart) -> Outcome:
        values, unit = part.column(self.of), UNITS[self.of]
        below = np.full_like(values, -np.inf) if self.at_least is None else self.at_least - values
        above = np.full_like(values, -np.inf) if self.at_most is None else values - self.at_most
        beyond = np.maximum(below, above)
        worst = int(beyond.argmax())
        value, at = float(values[worst]), float(part.times[worst])
        span = f"from {figure(values.min(), unit)} to {figure(values.max(), unit)}"
        said = f"{self.of} was {span}; {self.allowed} is allowed"
        return self._outcome(beyond[worst] <= 0, said, value, unit, at)
