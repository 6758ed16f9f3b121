"""What all criteria have in common: a name, points, a part of the flight that they look at, and an outcome."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from drone_sim.config.types import Checked, Finite, Label, ParameterError, Within
from drone_sim.grading.flown import UNITS, Flown
from drone_sim.grading.result import Outcome
from drone_sim.offline.timeline import MAX_TIME
from drone_sim.wording import near_names, shown

Seconds = Annotated[Finite, Within(0, MAX_TIME)]
Figure = Annotated[Finite, Within(-1e9, 1e9)]
Bound = Annotated[Finite, Within(0, 1e9)]
Points = Annotated[Finite, Within(0, 1e6)]


def _known(column: str) -> str:
    if column not in UNITS:
        raise ValueError(f"no such column of a flight; {near_names(column, UNITS)}")
    return column


Column = Annotated[str, AfterValidator(_known)]


class Criterion(Checked):
    """One entry of `criteria`; it looks at the flight from `after` to `until` (s), by default at all of it."""

    kind: str  # each kind names its own
    name: Label = ""  # the kind, where it is left out
    points: Points = 1.0
    after: Seconds = 0.0
    until: Seconds | None = None

    sees_touches: ClassVar[bool] = False  # whether it asks for Flown.touches

    def model_post_init(self, _context: Any) -> None:
        """Refuse a part of the flight that has no time in it."""
        if self.until is not None and self.until <= self.after:
            raise ParameterError(f"until = {self.until:g}: must be later than after = {self.after:g}", ())

    @property
    def called(self) -> str:
        """Its name."""
        return self.name or self.kind

    @property
    def allowed(self) -> str:
        """What passes, in words such as 'at most 1.5 s'."""
        raise NotImplementedError

    def judge(self, flown: Flown) -> Outcome:
        """Return how the flight did."""
        raise NotImplementedError

    # ---- for the kinds

    def part(self, flown: Flown) -> np.ndarray:
        """Return which rows it looks at, (N,) of bool; a row counts that is a rounding error outside."""
        until = math.inf if self.until is None else self.until
        return (flown.times >= self.after - 1e-9) & (flown.times <= until + 1e-9)

    def reached(self, flown: Flown) -> bool:
        """Tell whether the flight lasted until what it looks at had begun."""
        return bool(self.part(flown).any())

    def outcome(
        self, passed: bool, said: str, value: float | None = None, unit: str = "", at: float | None = None
    ) -> Outcome:
        """Return an outcome, with all points or none."""
        if value is not None and not math.isfinite(value):
            value = None
        points = self.points if passed else 0.0
        return Outcome(self.called, self.kind, passed, value, unit, self.allowed, points, self.points, at, said)

    def missed(self, why: str) -> Outcome:
        """Return that of a flight which did not get so far."""
        return self.outcome(False, why)


def figure(value: float, unit: str = "") -> str:
    """Return a figure as a sentence has it: four digits, and its unit."""
    return f"{value:.4g} {unit}".rstrip()


__all__ = ["Bound", "Column", "Criterion", "Field", "Figure", "Seconds", "figure", "shown"]
