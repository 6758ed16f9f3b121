"""Drift: how far the vehicle gets from a place, by default from where it was at `after`."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from drone_sim.config.types import Point
from drone_sim.grading.criteria.criterion import DistanceCriterion, FlightPart
from drone_sim.grading.result import Outcome


class Drift(DistanceCriterion):
    """`from` is [x, y, z] in m, in the world."""

    kind: Literal["drift"]
    place: Point | None = Field(default=None, alias="from")

    def _judged(self, part: FlightPart) -> Outcome:
        places = part.places()
        origin = places[0] if self.place is None else np.array(self.place)
        what = "where it began" if self.place is None else "its place"
        distances = np.linalg.norm(self._along(places - origin), axis=1)
        return self._outcome_of(distances, part.times, what)
