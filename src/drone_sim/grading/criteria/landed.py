"""Landed: the vehicle has flown, and at the end it rests on something, where and as softly as it should."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PlainValidator, TypeAdapter, ValidationError

from drone_sim.config.types import Coordinate, Label
from drone_sim.grading.criteria.criterion import Bound, Criterion, FlightPart, Missed, figure
from drone_sim.grading.flight_record import FlightRecord
from drone_sim.grading.result import Outcome
from drone_sim.vehicles.commands import CRASHED, LANDED

_AT_REST = 0.1  # m/s
_SETTLING = 0.5  # s; whoever is longer off the ground between two touches flies


def _place(value: Any) -> Any:
    if isinstance(value, str):
        return TypeAdapter(Label).validate_python(value)
    try:
        return TypeAdapter(tuple[Coordinate, Coordinate]).validate_python(value)
    except ValidationError:
        raise ValueError("must be 2 numbers, [x, y] in m, or the name of an object or vehicle") from None


_Place = Annotated[tuple[float, float] | str | None, PlainValidator(_place)]


class Landed(Criterion):
    """It looks at the end of its part: `until` is by when it has to stand.

    `at` is [x, y] in m, or the name of an object or vehicle; `within` so many metres of it, over ground. `softly` is
    the largest speed (m/s) in the step before the touch-down; `stands_on` is what is to be under it.
    """

    kind: Literal["landed"]
    at: _Place = None
    within: Bound = 0.3
    softly: Bound | None = None
    stands_on: Label = ""

    needs_contacts = True
    needs_states = True

    @property
    def allowed(self) -> str:
        """What passes."""
        wanted = [f"within {figure(self.within, 'm')}"] if self.at is not None else []
        wanted += [f"at most {figure(self.softly, 'm/s')}"] if self.softly is not None else []
        wanted += [f"on {self.stands_on}"] if self.stands_on else []
        return ", ".join(wanted) or "landed"

    @property
    def others(self) -> tuple[str, ...]:
        """What it asks for."""
        return (self.at,) if isinstance(self.at, str) else ()

    def _judged(self, part: FlightPart) -> Outcome:
        flight, end = part.flight, part.end
        down = _touch_down(flight, end)
        speed = float(flight.columns["speed"][np.searchsorted(flight.times, down) - 1])
        self._check_ground(flight, end)
        wrong, distance = [], self._distance(part)
        if distance is not None and distance > self.within:
            wrong.append(f"at most {figure(self.within, 'm')} is allowed")
        if self.softly is not None and speed > self.softly:
            wrong.append(f"at most {figure(self.softly, 'm/s')} is allowed")
        where = "" if distance is None else f" {figure(distance, 'm')} from {self._there}"
        said = f"landed at {down:.2f} s{where} with {figure(speed, 'm/s')}"
        value, unit = (speed, "m/s") if distance is None else (distance, "m")
        return self._outcome(not wrong, "; ".join([said, *wrong]), value, unit, down)

    @property
    def _there(self) -> str:
        return self.at if isinstance(self.at, str) else "its place"

    def _distance(self, part: FlightPart) -> float | None:
        """Return how far it stands from where it should, None where that is no matter."""
        if self.at is None:
            return None
        there = part.poses(self.at)[-1, :2] if isinstance(self.at, str) else np.array(self.at)
        return float(np.linalg.norm(part.places()[-1, :2] - there))

    def _check_ground(self, flight: FlightRecord, end: float) -> None:
        if not self.stands_on or not flight.contacts:
            return
        under = sorted({one.what for one in flight.contacts if end - _SETTLING <= one.at <= end})
        if self.stands_on not in under:
            raise Missed(f"stands on {' and '.join(under) or 'nothing'}, not on {self.stands_on}")


def _touch_down(flight: FlightRecord, end: float) -> float:
    """Return when (s) the vehicle touched down for the stay in which it is at `end`. Raises Missed."""
    state = next((str(one.value) for one in reversed(flight.states) if one.at <= end), "")
    if state == CRASHED:
        raise Missed("it has crashed, as its script says")
    if not flight.contacts and state == LANDED:  # of a flight that was only heard of
        return next(one.at for one in reversed(flight.states) if one.at <= end)
    last = int(np.searchsorted(flight.times, end, "right")) - 1
    speed = float(flight.columns["speed"][last])
    touches = [one.at for one in flight.contacts if one.at <= end + 1e-9]
    stay = np.split(touches, np.flatnonzero(np.diff(touches) > _SETTLING) + 1)[-1]  # no flight is in between
    if not len(stay) or end - stay[-1] > _SETTLING:
        raise Missed(f"is in the air at {end:.2f} s, {figure(float(flight.rows[last, 3]), 'm')} high")
    if not speed <= _AT_REST:
        raise Missed(
            f"still moves with {figure(speed, 'm/s')} at {end:.2f} s; at most {figure(_AT_REST, 'm/s')} is allowed"
        )
    if stay[0] - flight.times[0] < _SETTLING:
        raise Missed("never took off")
    return float(stay[0])
