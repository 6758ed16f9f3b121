"""Overshoot: how far a step response goes beyond the value that it is to have, in percent of the step.

The maximum percent overshoot of Ogata, Modern Control Engineering, 5th ed., section 5-3; of a second-order system with
the damping ratio d it is 100 exp(-pi d / sqrt(1 - d²)).
"""

from __future__ import annotations

from typing import Literal

from drone_sim.grading.criteria.criterion import FlightPart, Missed, figure
from drone_sim.grading.criteria.step_response import StepCriterion
from drone_sim.grading.result import Outcome

_RISEN = 0.9  # of the step


class Overshoot(StepCriterion):
    """`at_most` is in percent of the step. What does not rise to 90 % of it fails."""

    kind: Literal["overshoot"]

    unit = "%"

    def _judged(self, part: FlightPart) -> Outcome:
        times, share = self.response(part)
        peak = int(share.argmax())
        if share[peak] < _RISEN:
            raise Missed(f"came to {figure(100 * float(share[peak]), '%')} of the step: there was nothing to overshoot")
        over = 100 * max(0.0, float(share[peak]) - 1)
        return self._compared(over, f"went {figure(over, '%')} beyond", float(times[peak]) if over else None)
