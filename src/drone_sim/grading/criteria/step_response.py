"""Step responses: how a column behaves from the moment when its target changes from one value to another."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from drone_sim.config.types import ParameterError
from drone_sim.grading.criteria.criterion import AtMostCriterion, Column, Figure, FlightPart, Missed, figure
from drone_sim.grading.flight_record import UNITS


class Response(NamedTuple):
    """A step response from 0 to 1: times (s) and the share of the step that is done, (M,) each."""

    times: np.ndarray
    share: np.ndarray


class StepCriterion(AtMostCriterion):
    """A step of a column at the time `after`, from one value to another; linear between two rows."""

    of: Column
    start: Figure | None = Field(default=None, alias="from")  # where it is at `after`, where left out
    to: Figure

    unit = "s"

    def model_post_init(self, context: Any) -> None:
        """Refuse a step of height 0."""
        super().model_post_init(context)
        if self.start == self.to:
            raise ParameterError("is the same as `from`: there would be no step", ("to",), f"{self.to:g}")

    def response(self, part: FlightPart) -> Response:
        """Return the response in a part of the flight. Raises Missed."""
        values = part.column(self.of)
        start = values[0] if self.start is None else self.start
        if start == self.to:
            raise Missed(f"{self.of} was at {figure(self.to, UNITS[self.of])} before: there was no step")
        return Response(part.times, (values - start) / (self.to - start))


def crossing(response: Response, level: float) -> float | None:
    """Return when (s) a response first is at a level or beyond it; None for never."""
    beyond = np.flatnonzero(response.share >= level)
    if not len(beyond):
        return None
    index = int(beyond[0])
    return between(response, index - 1, level) if index else float(response.times[0])


def between(response: Response, index: int, level: float) -> float:
    """Return when (s) a response crosses a level between the rows `index` and `index + 1`, which are around it."""
    (first, second), (before, after) = response.times[index : index + 2], response.share[index : index + 2]
    return float(first + (level - before) / (after - before) * (second - first))
