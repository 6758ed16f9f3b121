"""Settling time: how long it takes until a step response stays within a band about the value that it is to have.

As in Ogata, Modern Control Engineering, 5th ed., section 5-3, where the band is 2 % or 5 % of the step; of a
first-order lag it is -ln(band) time constants: 3.912 for 2 %.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from drone_sim.config.types import Finite, Within
from drone_sim.grading.criteria.criterion import FlightPart, figure
from drone_sim.grading.criteria.step_response import StepCriterion, between
from drone_sim.grading.result import Outcome


class SettlingTime(StepCriterion):
    """`at_most` is in s after the step; `band` is a share of the step."""

    kind: Literal["settling_time"]
    band: Annotated[Finite, Within(1e-6, 1)] = 0.02

    def _judged(self, part: FlightPart) -> Outcome:
        response = self.response(part)
        band = figure(100 * self.band, "%")
        outside = np.flatnonzero(np.abs(response.share - 1) > self.band)
        last = int(outside[-1]) if len(outside) else -1
        if last == len(response.share) - 1:
            off = figure(100 * abs(float(response.share[-1]) - 1), "%")
            return self._outcome(False, f"did not settle within {band}: at the end it was {off} of the step away")
        edge = 1 + self.band if last >= 0 and response.share[last] > 1 else 1 - self.band
        settled = float(response.times[0]) if last < 0 else between(response, last, edge)
        took = settled - self.after
        return self._compared(took, f"settled within {band} in {figure(took, 's')}", settled)
