"""The base classes of the criteria."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, TypeAdapter, ValidationError

from drone_sim.config.types import Checked, Finite, Label, ParameterError, Within
from drone_sim.grading.flight_record import UNITS, FlightRecord
from drone_sim.grading.result import Outcome
from drone_sim.message_text import near_names
from drone_sim.offline.timeline import MAX_TIME

Seconds = Annotated[Finite, Within(0, MAX_TIME)]
Figure = Annotated[Finite, Within(-1e9, 1e9)]
Bound = Annotated[Finite, Within(0, 1e9)]
Hint = Annotated[str, Field(max_length=300)]  # a sentence
ROUNDING = 1e-9  # s, tolerance when times of rows are compared with times of the plan


def _check_column(column: str) -> str:
    if column not in UNITS:
        raise ValueError(f"no such column of a flight; {near_names(column, UNITS)}")
    return column


Column = Annotated[str, AfterValidator(_check_column)]


def label_or(kind: Any, message: str) -> PlainValidator:
    """Return a validator of a name or a value of another type, whose error has the given message."""

    def validate(value: Any) -> Any:
        if isinstance(value, str):
            return TypeAdapter(Label).validate_python(value)
        try:
            return TypeAdapter(kind).validate_python(value)
        except ValidationError:
            raise ValueError(message) from None

    return PlainValidator(validate)


class CriterionFailed(Exception):
    """The criterion fails without a figure; the message is a sentence that says why."""


class FlightPart(NamedTuple):
    """The part of a flight that a criterion looks at: M of its N rows, at least one."""

    flight: FlightRecord
    rows: np.ndarray  # (N,) of bool

    @property
    def times(self) -> np.ndarray:
        """Simulated time of each row in s, (M,)."""
        return self.flight.times[self.rows]

    @property
    def end(self) -> float:
        """Simulated time of the last row in s."""
        return float(self.times[-1])

    def column(self, name: str) -> np.ndarray:
        """Return a column, (M,). Raises CriterionFailed if a value is not finite."""
        values = self.flight.columns[name][self.rows]
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise CriterionFailed(f"{name} is not a finite number at {self.times[bad[0]]:.2f} s")
        return values

    def positions(self) -> np.ndarray:
        """Return the vehicle's positions, (M, 3) in m. Raises CriterionFailed if one is not finite."""
        positions = self.flight.rows[self.rows, 1:4]
        if not np.isfinite(positions).all():
            raise CriterionFailed("the position of the vehicle is not finite in a row of the table")
        return positions

    def poses(self, name: str) -> np.ndarray:
        """Return the poses of another vehicle or object, (M, 7); for a path, those of the first object that it finds.

        Raises CriterionFailed if the object does not exist, or was removed.
        """
        name = self.flight.objects_by_path.get(name, [name])[0]
        if name not in self.flight.object_poses:
            raise CriterionFailed(f"the flight has no '{name}'; {near_names(name, self.flight.object_poses)}")
        poses = self.flight.object_poses[name][self.rows]
        removed = np.flatnonzero(~np.isfinite(poses).all(axis=1))
        if len(removed):
            raise CriterionFailed(f"{name} is gone at {self.times[removed[0]]:.2f} s")
        return poses


class Criterion(Checked):
    """An entry of `criteria`, which judges the flight from `after` to `until` (s), by default all of it."""

    kind: str  # a Literal in every subclass
    name: Label = ""  # the default is the kind
    points: Annotated[Finite, Within(0, 1e6)] = 1.0
    after: Seconds = 0.0
    until: Seconds | None = None
    hint: Hint = ""  # what to try if it fails; every kind has a default

    is_lasting: ClassVar[bool] = True  # whether it must hold until the end of its part
    needs_contacts: ClassVar[bool] = False  # whether it reads FlightRecord.contacts
    needs_states: ClassVar[bool] = False  # whether it reads FlightRecord.states

    def model_post_init(self, _context: Any) -> None:
        """Refuse an empty part of the flight."""
        if self.until is not None and self.until <= self.after:
            raise ParameterError(f"must be later than after = {self.after:g}", ("until",), f"{self.until:g}")

    @property
    def label(self) -> str:
        return self.name or self.kind

    @property
    @abstractmethod
    def allowed(self) -> str:
        """What passes, in words such as 'at most 1.5 s'."""

    @property
    def object_names(self) -> tuple[str, ...]:
        """Names and paths of the vehicles and objects that it needs in FlightRecord.object_poses."""
        return ()

    @property
    def path_names(self) -> tuple[str, ...]:
        """Names of the scene's paths that it needs in FlightRecord.paths."""
        return ()

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that it needs in FlightRecord.values."""
        return ()

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics that it needs in FlightRecord.values."""
        return ()

    def judge(self, flight: FlightRecord) -> Outcome:
        """Return the outcome of a flight; the criterion fails if the flight ended too early for it."""
        until = math.inf if self.until is None else self.until
        rows = (flight.times >= self.after - ROUNDING) & (flight.times <= until + ROUNDING)
        if not rows.any():
            return self.fail(f"the flight was over at {flight.end:.2f} s, before this began")
        try:
            outcome = self._judge_part(FlightPart(flight, rows))
        except CriterionFailed as failure:
            return self.fail(str(failure))
        is_cut_off = not flight.is_whole and flight.end < until - ROUNDING
        if outcome.passed and self.is_lasting and is_cut_off:
            return self.fail(f"the flight was over at {flight.end:.2f} s, too early for this")
        return outcome

    @abstractmethod
    def _judge_part(self, part: FlightPart) -> Outcome:
        """Return the outcome of a part of a flight. Raises CriterionFailed."""

    def fail(self, reason: str) -> Outcome:
        """Return the outcome of a flight that fails without a figure."""
        return self._make_outcome(False, reason)

    def _make_outcome(
        self, passed: bool, sentence: str, value: float | None = None, unit: str = "", at: float | None = None
    ) -> Outcome:
        """Return an outcome with all points or none; a `value` that is not finite becomes None."""
        if value is not None:
            value = float(value) if math.isfinite(value) else None
        points = self.points if passed else 0.0
        at = None if at is None else float(at)
        return Outcome(
            self.label, self.kind, bool(passed), value, unit, self.allowed, points, self.points, at, sentence
        )


class AtMostCriterion(Criterion):
    """A criterion whose figure must not be larger than `at_most`."""

    at_most: Bound

    unit: ClassVar[str] = ""  # of the figure

    @property
    def allowed(self) -> str:
        return f"at most {format_figure(self.at_most, self.unit)}"

    def _compare(self, value: float, sentence: str, at: float | None = None) -> Outcome:
        """Return the outcome of a figure, which `sentence` explains and which was reached at the time `at` (s)."""
        return self._make_outcome(value <= self.at_most, f"{sentence}; {self.allowed} is allowed", value, self.unit, at)


def format_figure(value: float, unit: str = "") -> str:
    """Return a figure with four significant digits and its unit."""
    return f"{value:.4g} {unit}".rstrip()
