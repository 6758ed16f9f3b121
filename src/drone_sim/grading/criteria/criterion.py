"""What criteria have in common: all of them, and those of a distance."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator

from drone_sim.config.types import Checked, Finite, Label, ParameterError, Within
from drone_sim.grading.flight_record import UNITS, FlightRecord
from drone_sim.grading.result import Outcome
from drone_sim.message_text import near_names
from drone_sim.offline.timeline import MAX_TIME

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
    """A flight lacks something that a criterion needs; the message is a sentence that says what."""


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
        """Return a column, (M,). Raises Missed where it holds what is no number."""
        values = self.flight.columns[name][self.rows]
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise Missed(f"{name} is not a finite number at {self.times[bad[0]]:.2f} s")
        return values

    def places(self) -> np.ndarray:
        """Return where the vehicle was, (M, 3) in m. Raises Missed where that is no place."""
        places = self.flight.rows[self.rows, 1:4]
        if not np.isfinite(places).all():
            raise Missed("a row of the table has no place of the vehicle")
        return places

    def poses(self, name: str) -> np.ndarray:
        """Return the poses of another vehicle or object, (M, 7); of a path the first that it finds. Raises Missed."""
        name = self.flight.found.get(name, [name])[0]
        if name not in self.flight.other_poses:
            raise Missed(f"the flight has no '{name}'; {near_names(name, self.flight.other_poses)}")
        poses = self.flight.other_poses[name][self.rows]
        gone = np.flatnonzero(~np.isfinite(poses).all(axis=1))
        if len(gone):
            raise Missed(f"{name} is gone at {self.times[gone[0]]:.2f} s")
        return poses


class Criterion(Checked):
    """One entry of `criteria`; it looks at the flight from `after` to `until` (s), by default at all of it."""

    kind: str  # each kind names its own
    name: Label = ""  # the kind, where it is left out
    points: Annotated[Finite, Within(0, 1e6)] = 1.0
    after: Seconds = 0.0
    until: Seconds | None = None

    is_lasting: ClassVar[bool] = True  # whether it has to hold to the end of its part
    needs_contacts: ClassVar[bool] = False  # whether it asks for FlightRecord.contacts
    needs_states: ClassVar[bool] = False  # whether it asks for FlightRecord.states

    def model_post_init(self, _context: Any) -> None:
        """Refuse a part of the flight that has no time in it."""
        if self.until is not None and self.until <= self.after:
            raise ParameterError(f"must be later than after = {self.after:g}", ("until",), f"{self.until:g}")

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
        """Names and paths of vehicles and objects that it asks for in FlightRecord.other_poses."""
        return ()

    @property
    def lines(self) -> tuple[str, ...]:
        """Names of the scene's paths that it needs in FlightRecord.lines."""
        return ()

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of signals that it asks for in FlightRecord.values."""
        return ()

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of topics that it asks for in FlightRecord.values."""
        return ()

    def judge(self, flight: FlightRecord) -> Outcome:
        """Return how the flight did; a criterion fails if the flight ended too early for it."""
        until = math.inf if self.until is None else self.until
        rows = (flight.times >= self.after - _ROUNDING) & (flight.times <= until + _ROUNDING)
        if not rows.any():
            return self.missed(f"the flight was over at {flight.end:.2f} s, before this began")
        try:
            outcome = self._judged(FlightPart(flight, rows))
        except Missed as missed:
            return self.missed(str(missed))
        is_cut_off = not flight.is_whole and flight.end < until - _ROUNDING
        if outcome.passed and self.is_lasting and is_cut_off:
            return self.missed(f"the flight was over at {flight.end:.2f} s, too early for this")
        return outcome

    def missed(self, why: str) -> Outcome:
        """Return the outcome of a flight that did not get so far."""
        return self._outcome(False, why)

    @abstractmethod
    def _judged(self, part: FlightPart) -> Outcome:
        """Return how a flight did in this part of it. Raises Missed."""

    def _outcome(
        self, passed: bool, said: str, value: float | None = None, unit: str = "", at: float | None = None
    ) -> Outcome:
        """Return an outcome, with all points or none."""
        if value is not None:
            value = float(value) if math.isfinite(value) else None
        points = self.points if passed else 0.0
        at = None if at is None else float(at)
        return Outcome(self.called, self.kind, bool(passed), value, unit, self.allowed, points, self.points, at, said)


def figure(value: float, unit: str = "") -> str:
    """Return a figure as a sentence has it: four digits, and its unit."""
    return f"{value:.4g} {unit}".rstrip()


class AtMostCriterion(Criterion):
    """A figure that is not to be larger than `at_most`."""

    at_most: Bound

    unit: ClassVar[str] = ""  # of the figure

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, self.unit)}"

    def _compared(self, value: float, said: str, at: float | None = None) -> Outcome:
        """Return the outcome of a figure; `said` is a sentence about how it came about, `at` when (s)."""
        return self._outcome(value <= self.at_most, f"{said}; {self.allowed} is allowed", value, self.unit, at)


# ---- distances

Axes = Literal["xyz", "xy", "xz", "yz", "x", "y", "z"]
Measure = Literal["largest", "mean", "rms"]
_WORDS = {"largest": "up to", "mean": "in the mean", "rms": "in the root mean square"}


class DistanceCriterion(AtMostCriterion):
    """A distance (m) along some axes of the world that is not to be larger than `at_most`."""

    axes: Axes = "xyz"
    measure: Measure = "largest"

    unit = "m"

    def _along(self, vectors: np.ndarray) -> np.ndarray:
        """Return the columns of (..., 3) that count."""
        return vectors[..., ["xyz".index(axis) for axis in self.axes]]

    def _outcome_of(self, distances: np.ndarray, times: np.ndarray, what: str) -> Outcome:
        """Return the outcome of distances (M,) at these times (M,); `what`: what they are measured from, in words."""
        worst = int(distances.argmax())
        value = {
            "largest": float(distances[worst]),
            "mean": float(distances.mean()),
            "rms": float(np.sqrt((distances**2).mean())),
        }[self.measure]
        when = f" at {times[worst]:.2f} s" if self.measure == "largest" else ""
        said = f"was {_WORDS[self.measure]} {figure(value, 'm')} from {what}{when}"
        return self._compared(value, said, float(times[worst]))


def to_polyline(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances (M,) from places (M, D) to the nearest point of a polyline with corners (K, D), K >= 2."""
    squares = np.full(len(places), np.inf)
    for start, way in zip(corners[:-1], np.diff(corners, axis=0)):  # in turn: a flight may have many rows
        to, length = places - start, float(way @ way)
        share = np.clip(to @ way / length, 0, 1) if length else np.zeros(len(places))
        squares = np.minimum(squares, ((to - share[:, None] * way) ** 2).sum(axis=1))
    return np.sqrt(squares)
