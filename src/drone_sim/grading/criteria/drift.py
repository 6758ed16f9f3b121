"""Drift: how far the vehicle gets from a place, by default from where it was at `after`."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from drone_sim.config.types import Point
from drone_sim.grading.criteria.places import DistanceCriterion, places_of
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome


class Drift(DistanceCriterion):
    """`from` is [x, y, z] in m, in the world."""

    kind: Literal["drift"]
    place: Point | None = Field(default=None, alias="from")

    def _judged(self, flown: Flown, part: np.ndarray) -> Outcome:
        places = places_of(flown, part)
        origin = places[0] if self.place is None else np.array(self.place)
        what = "where it began" if self.place is None else "its place"
        distances = np.linalg.norm(self._along(places - origin), axis=1)
        return self._outcome_of(distances, flown.times[part], what)
