"""What all criteria have in common: a name, points, a part of the flight that they look at, and an outcome."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator

from drone_sim.config.types import Checked, Finite, Label, ParameterError, Within
from drone_sim.grading.flown import UNITS, Flown
from drone_sim.grading.result import Outcome
from drone_sim.offline.timeline import MAX_TIME
from drone_sim.wording import near_names

Seconds = Annotated[Finite, Within(0, MAX_TIME)]
Figure = Annotated[Finite, Within(-1e9, 1e9)]
Bound = Annotated[Finite, Within(0, 1e9)]
_ROUNDING = 1e-9  # s, by which a row's time may miss what is meant


def _known(column: str) -> str:
    if column not in UNITS:
        raise ValueError(f"no such column of a flight; {near_names(column, UNITS)}")
    return column


Column = Annotated[str, AfterValidator(_known)]


class Missed(Exception):
    """A flight has nothing by which a criterion could be met; a sentence that says why."""


class Criterion(Checked):
    """One entry of `criteria`; it looks at the flight from `after` to `until` (s), by default at all of it."""

    kind: str  # each kind names its own
    name: Label = ""  # the kind, where it is left out
    points: Annotated[Finite, Within(0, 1e6)] = 1.0
    after: Seconds = 0.0
    until: Seconds | None = None

    is_lasting: ClassVar[bool] = True  # whether it has to hold to the end of its part
    sees_touches: ClassVar[bool] = False  # whether it asks for Flown.touches
    sees_states: ClassVar[bool] = False  # whether it asks for Flown.states

    def model_post_init(self, _context: Any) -> None:
        """Refuse a part of the flight that has no time in it."""
        if self.until is not None and self.until <= self.after:
            raise ParameterError(f"until = {self.until:g}: must be later than after = {self.after:g}")

    @property
    def called(self) -> str:
        """Its name."""
        return self.name or self.kind

    @property
    @abstractmethod
    def allowed(self) -> str:
        """What passes, in words such as 'at most 1.5 s'."""

    @property
    def others(self) -> tuple[str, ...]:
        """Names of vehicles and objects that it asks for in Flown.others."""
        return ()

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of signals that it asks for in Flown.signals."""
        return ()

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of topics that it asks for in Flown.topics."""
        return ()

    def judge(self, flown: Flown) -> Outcome:
        """Return how the flight did; what it did not get to fails."""
        part = self._part(flown)
        if not part.any():
            return self.missed(f"the flight was over at {flown.end:.2f} s, before this began")
        try:
            outcome = self._judged(flown, part)
        except Missed as missed:
            return self.missed(str(missed))
        is_cut_off = not flown.is_whole and (self.until is None or flown.end < self.until - _ROUNDING)
        if outcome.passed and self.is_lasting and is_cut_off:
            return self.missed(f"the flight was over at {flown.end:.2f} s, too early for this")
        return outcome

    def missed(self, why: str) -> Outcome:
        """Return the outcome of a flight that did not get so far."""
        return self._outcome(False, why)

    @abstractmethod
    def _judged(self, flown: Flown, part: np.ndarray) -> Outcome:
        """Return how a flight did in this part of its rows, (N,) of bool, at least one. Raises Missed."""

    # ---- for the kinds

    def _part(self, flown: Flown) -> np.ndarray:
        until = math.inf if self.until is None else self.until
        return (flown.times >= self.after - _ROUNDING) & (flown.times <= until + _ROUNDING)

    def _outcome(
        self, passed: bool, said: str, value: float | None = None, unit: str = "", at: float | None = None
    ) -> Outcome:
        """Return an outcome, with all points or none."""
        if value is not None:
            value = float(value) if math.isfinite(value) else None
        points = self.points if passed else 0.0
        at = None if at is None else float(at)
        return Outcome(self.called, self.kind, bool(passed), value, unit, self.allowed, points, self.points, at, said)


def values_of(flown: Flown, column: str, part: np.ndarray) -> np.ndarray:
    """Return a column in a part of a flight. Raises Missed where it holds what is no number."""
    values = flown.columns[column][part]
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise Missed(f"{column} is no finite number at {flown.times[part][bad[0]]:.2f} s")
    return values


def figure(value: float, unit: str = "") -> str:
    """Return a figure as a sentence has it: four digits, and its unit."""
    return f"{value:.4g} {unit}".rstrip()
