"""Attitude: how far the vehicle leans at most."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from drone_sim.config.types import Finite, Within
from drone_sim.grading.criteria.criterion import Criterion, figure, values_of
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome


class Attitude(Criterion):
    """`at_most` is the angle (rad) between the vehicle's axis and the vertical, in whatever direction it leans."""

    kind: Literal["attitude"]
    at_most: Annotated[Finite, Within(0, 3.2)]

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, 'rad')}"

    def _judged(self, flown: Flown, part: np.ndarray) -> Outcome:
        tilt = values_of(flown, "tilt", part)
        worst = int(tilt.argmax())
        most, at = float(tilt[worst]), float(flown.times[part][worst])
        said = f"leaned by {figure(most, 'rad')} at {at:.2f} s; {self.allowed} are allowed"
        return self._outcome(most <= self.at_most, said, most, "rad", at)
