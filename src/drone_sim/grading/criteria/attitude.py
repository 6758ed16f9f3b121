"""Attitude: how far the vehicle leans at most."""

from __future__ import annotations

from typing import Annotated, Literal

from drone_sim.config.types import Finite, Within
from drone_sim.grading.criteria.criterion import AtMostCriterion, FlightPart, figure
from drone_sim.grading.result import Outcome


class Attitude(AtMostCriterion):
    """`at_most` is the angle (rad) between the vehicle's axis and the vertical, in whatever direction it leans."""

    kind: Literal["attitude"]
    at_most: Annotated[Finite, Within(0, 3.2)]

    unit = "rad"

    def _judged(self, part: FlightPart) -> Outcome:
        tilt = part.column("tilt")
        worst = int(tilt.argmax())
        most, at = float(tilt[worst]), float(part.times[worst])
        return self._compared(most, f"leaned by {figure(most, 'rad')} at {at:.2f} s", at)
