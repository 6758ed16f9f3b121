"""Rise time: how long a step response takes from 10 % to 90 % of the step.

The definition for overdamped systems in Ogata, Modern Control Engineering, 5th ed., section 5-3, and that of MATLAB's
stepinfo; of a first-order lag it is ln 9 = 2.197 time constants. What the response does after that is no matter here.
"""

from __future__ import annotations

from typing import Literal

from drone_sim.grading.criteria.criterion import FlightPart, figure
from drone_sim.grading.criteria.step_response import StepCriterion, crossing
from drone_sim.grading.result import Outcome

_LOW, _HIGH = 0.1, 0.9


class RiseTime(StepCriterion):
    """`at_most` is in s."""

    kind: Literal["rise_time"]

    is_lasting = False

    def _judged(self, part: FlightPart) -> Outcome:
        response = self.response(part)
        began, ended = crossing(response, _LOW), crossing(response, _HIGH)
        if began is None or ended is None:
            most = figure(100 * float(response.share.max()), "%")
            return self._outcome(False, f"never rose to 90 % of the step, but to {most}")
        return self._compared(ended - began, f"rose in {figure(ended - began, 's')}", ended)
