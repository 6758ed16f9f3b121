"""Criteria of what the vehicle touches."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from drone_sim.config.types import Coordinate, Label
from drone_sim.grading.criteria.criterion import (
    ROUNDING,
    Bound,
    Criterion,
    CriterionFailed,
    FlightPart,
    Hint,
    format_figure,
    label_or,
)
from drone_sim.grading.flight_record import FlightRecord
from drone_sim.grading.result import Outcome
from drone_sim.vehicles.commands import CRASHED, LANDED

_AT_REST = 0.1  # m/s
_SETTLING = 0.5  # s; a longer time without a contact is flight


class NoContact(Criterion):
    """The vehicle touches nothing but `allow`, names as the sensor `contacts` gives them; every sub-step counts."""

    kind: Literal["no_contact"]
    hint: Hint = "Keep a larger distance from what you touched, and slow down before it."
    allow: Annotated[list[Label], Field(max_length=100)] = Field(default_factory=list)

    needs_contacts = True

    @property
    def allowed(self) -> str:
        return f"only {', '.join(self.allow)}" if self.allow else "nothing"

    def _judge_part(self, part: FlightPart) -> Outcome:
        first, last = part.times[[0, -1]]
        forbidden = [
            contact
            for contact in part.flight.contacts
            if first <= contact.at <= last and contact.name not in self.allow
        ]
        if not forbidden:
            return self._make_outcome(True, "touched nothing it was not allowed to", 0.0)
        names = list(dict.fromkeys(contact.name for contact in forbidden))
        touched = f"touched {names[0]} at {forbidden[0].at:.2f} s{''.join(f', then {name}' for name in names[1:])}"
        sentence = f"{touched}; it may touch {self.allowed}"
        return self._make_outcome(False, sentence, float(len(names)), "", forbidden[0].at)


_LandingPlace = Annotated[
    tuple[float, float] | str | None,
    label_or(tuple[Coordinate, Coordinate], "must be 2 numbers, [x, y] in m, or the name of an object or vehicle"),
]


class Landed(Criterion):
    """The vehicle has flown, and stands at the end of the part.

    `at` is [x, y] in m, or the name of an object or vehicle; the vehicle must stand `within` so many metres of it,
    measured horizontally. `softly` is the largest speed (m/s) in the step before the touch-down; `stands_on` is the
    name of the object under the vehicle.
    """

    kind: Literal["landed"]
    hint: Hint = "Descend slowly, and only while you are above the place."
    at: _LandingPlace = None
    within: Bound = 0.3
    softly: Bound | None = None
    stands_on: Label = ""

    needs_contacts = True
    needs_states = True

    @property
    def allowed(self) -> str:
        wanted = [f"within {format_figure(self.within, 'm')}"] if self.at is not None else []
        wanted += [f"at most {format_figure(self.softly, 'm/s')}"] if self.softly is not None else []
        wanted += [f"on {self.stands_on}"] if self.stands_on else []
        return ", ".join(wanted) or "landed"

    @property
    def object_names(self) -> tuple[str, ...]:
        return (self.at,) if isinstance(self.at, str) else ()

    def _judge_part(self, part: FlightPart) -> Outcome:
        flight, end = part.flight, part.end
        touch_down = _touch_down_time(flight, end)
        speed = float(flight.columns["speed"][np.searchsorted(flight.times, touch_down) - 1])
        if self.stands_on and flight.contacts:
            under = sorted({contact.name for contact in flight.contacts if end - _SETTLING <= contact.at <= end})
            if self.stands_on not in under:
                raise CriterionFailed(f"stands on {' and '.join(under) or 'nothing'}, not on {self.stands_on}")
        value, unit, where, faults = speed, "m/s", "", []
        if self.at is not None:
            target = part.poses(self.at)[-1, :2] if isinstance(self.at, str) else np.array(self.at)
            value, unit = float(np.linalg.norm(part.positions()[-1, :2] - target)), "m"
            where = f" {format_figure(value, 'm')} from {self.at if isinstance(self.at, str) else 'its place'}"
            if value > self.within:
                faults.append(f"at most {format_figure(self.within, 'm')} is allowed")
        if self.softly is not None and speed > self.softly:
            faults.append(f"at most {format_figure(self.softly, 'm/s')} is allowed")
        sentence = f"landed at {touch_down:.2f} s{where} with {format_figure(speed, 'm/s')}"
        return self._make_outcome(not faults, "; ".join([sentence, *faults]), value, unit, touch_down)


def _touch_down_time(flight: FlightRecord, end: float) -> float:
    """Return when (s) the vehicle touched down for the last time before `end`. Raises CriterionFailed if it flies."""
    last_state = next((change for change in reversed(flight.states) if change.at <= end), None)
    state = "" if last_state is None else str(last_state.value)
    if state == CRASHED:
        raise CriterionFailed("it has crashed, as its script says")
    if last_state is not None and not flight.contacts and state == LANDED:  # grade_live without the contacts sensor
        return last_state.at
    row = int(np.searchsorted(flight.times, end, "right")) - 1
    speed = float(flight.columns["speed"][row])
    contact_times = [contact.at for contact in flight.contacts if contact.at <= end + ROUNDING]
    # The contacts since the vehicle last was off the ground for longer than it settles.
    standing = np.split(contact_times, np.flatnonzero(np.diff(contact_times) > _SETTLING) + 1)[-1]
    if not len(standing) or end - standing[-1] > _SETTLING:
        raise CriterionFailed(f"is in the air at {end:.2f} s, {format_figure(float(flight.rows[row, 3]), 'm')} high")
    if not speed <= _AT_REST:
        moving, limit = format_figure(speed, "m/s"), format_figure(_AT_REST, "m/s")
        raise CriterionFailed(f"still moves with {moving} at {end:.2f} s; at most {limit} is allowed")
    if standing[0] - flight.times[0] < _SETTLING:
        raise CriterionFailed("never took off")
    return float(standing[0])
