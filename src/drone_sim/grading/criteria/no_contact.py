"""No contact: the vehicle touches nothing but what it may."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drone_sim.config.types import Label
from drone_sim.grading.criteria.criterion import Criterion
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome


class NoContact(Criterion):
    """Every sub-step counts, however short the touch."""

    kind: Literal["no_contact"]
    allow: Annotated[list[Label], Field(max_length=100)] = []  # names of what it may touch

    sees_touches = True

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"only {', '.join(self.allow)}" if self.allow else "no contact"

    def judge(self, flown: Flown) -> Outcome:
        """Return how the flight did."""
        until = flown.end if self.until is None else self.until
        found = [one for one in flown.touches if self.after < one.at <= until and one.what not in self.allow]
        if not found:
            return self.outcome(True, "touched nothing", 0.0, "touches")
        first = found[0]
        said = f"touched {first.what or 'something without a name'} at {first.at:.2f} s; it may touch {self.allowed}"
        return self.outcome(False, said, float(len({one.what for one in found})), "touches", first.at)
