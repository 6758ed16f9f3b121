"""Overshoot: how far a step response goes beyond the value that it is to have, in percent of the step.

The maximum percent overshoot of Ogata, Modern Control Engineering, 5th ed., section 5-3; of a second-order system with
the damping ratio d it is 100 exp(-pi d / sqrt(1 - d²)).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from drone_sim.grading.criteria.criterion import Missed, figure
from drone_sim.grading.criteria.steps import StepCriterion
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome

_RISEN = 0.9  # of the step


class Overshoot(StepCriterion):
    """`at_most` is in percent of the step. What does not rise to 90 % of it fails."""

    kind: Literal["overshoot"]

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, '%')}"

    def _judged(self, flown: Flown, part: np.ndarray) -> Outcome:
        times, share = self.response(flown, part)
        peak = int(share.argmax())
        if share[peak] < _RISEN:
            raise Missed(f"came to {figure(100 * float(share[peak]), '%')} of the step: there was nothing to overshoot")
        over = 100 * max(0.0, float(share[peak]) - 1)
        said = f"went {figure(over, '%')} beyond; {self.allowed} are allowed"
        return self._outcome(over <= self.at_most, said, over, "%", float(times[peak]) if over else None)
