"""No contact: the vehicle touches nothing but what it may."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drone_sim.config.types import Label
from drone_sim.grading.criteria.criterion import Criterion, FlightPart
from drone_sim.grading.result import Outcome


class NoContact(Criterion):
    """Every sub-step counts, however short the touch; `allow` has names, as the sensor `contacts` says them."""

    kind: Literal["no_contact"]
    allow: Annotated[list[Label], Field(max_length=100)] = Field(default_factory=list)

    needs_contacts = True

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"only {', '.join(self.allow)}" if self.allow else "nothing"

    def _judged(self, part: FlightPart) -> Outcome:
        first, last = part.times[[0, -1]]
        found = [one for one in part.flight.contacts if first <= one.at <= last and one.what not in self.allow]
        if not found:
            return self._outcome(True, "touched nothing it was not allowed to", 0.0)
        what = list(dict.fromkeys(one.what for one in found))
        said = f"touched {what[0]} at {found[0].at:.2f} s{''.join(f', then {one}' for one in what[1:])}"
        said = f"{said}; it may touch {self.allowed}"
        return self._outcome(False, said, float(len(what)), "", found[0].at)
