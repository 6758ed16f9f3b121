"""Path: how far the vehicle gets from a polyline, and how much of that it has flown."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from drone_sim.config.types import Fraction, Label, Point
from drone_sim.grading.criteria.criterion import DistanceCriterion, FlightPart, Missed, figure, to_polyline
from drone_sim.grading.result import Outcome

MAX_CORNERS = 1000
_SAMPLES = 400  # of the path, at which it is seen whether the vehicle has been there


class PathFollowing(DistanceCriterion):
    """`along` are the polyline's corners, or the name of a path in the scene; `closed`: it goes back to the first.

    `covers` is the share of it that has to be flown: all that the vehicle has been within `at_most` of.
    """

    kind: Literal["path"]
    along: Annotated[list[Point], Field(min_length=2, max_length=MAX_CORNERS)] | Label
    closed: bool = False
    covers: Fraction = 0.0

    @property
    def lines(self) -> tuple[str, ...]:
        """The name of the path that it needs, if it names one."""
        return (self.along,) if isinstance(self.along, str) else ()

    def _judged(self, part: FlightPart) -> Outcome:
        places, corners = self._along(part.places()), self._along(self._corners(part))
        if self.closed:
            corners = np.vstack((corners, corners[:1]))
        covered = _covered(corners, places, self.at_most) if self.covers else 1.0
        if covered < self.covers:
            share, wanted = (figure(100 * one, "%") for one in (covered, self.covers))
            return self._outcome(False, f"flew {share} of the path; at least {wanted} is wanted")
        return self._outcome_of(to_polyline(places, corners), part.times, "the path")

    def _corners(self, part: FlightPart) -> np.ndarray:
        """Return the polyline's corners (K, 3) in m, in the world. Raises Missed."""
        if not isinstance(self.along, str):
            return np.array(self.along)
        if self.along not in part.flight.lines:
            raise Missed(f"the flight has no path '{self.along}'")
        return part.flight.lines[self.along]


def _covered(corners: np.ndarray, places: np.ndarray, radius: float) -> float:
    """Return the share of a polyline (K, D) that is within a radius of one of the places (M, D)."""
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    ways = np.concatenate(([0.0], np.cumsum(lengths)))
    at = np.linspace(0, ways[-1], _SAMPLES)
    samples = np.column_stack([np.interp(at, ways, column) for column in corners.T])
    return float(np.mean([((places - one) ** 2).sum(axis=1).min() <= radius**2 for one in samples]))
