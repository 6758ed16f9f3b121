"""The result of one graded flight: an outcome with a figure for each criterion."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any


@dataclass(frozen=True)
class Outcome:
    name: str
    kind: str
    passed: bool
    value: float | None  # the figure, in `unit`; None if there is none
    unit: str  # '' for a count
    allowed: str  # the allowed figures, such as 'at most 1.5 s'
    points: float  # awarded
    of: float  # possible points
    at: float | None  # the simulated time (s) of the deciding moment; None if there is no such moment
    said: str  # a sentence with the figure


@dataclass(frozen=True)
class Result:
    """The result of one flight of a plan. Conversion to JSON and back loses nothing."""

    plan: str
    script: str  # '' is the built-in script
    seed: int
    changes: Mapping[str, Any]  # keys of config/drone.yaml that override the plan's
    passed: bool
    points: float
    of: float
    flown: float  # s of simulated time
    error: str | None  # one line; None if the flight came to its end
    outcomes: tuple[Outcome, ...] = field(default=())
    digest: str = ""  # SHA-256 of the table's numbers, as little-endian doubles; '' if nothing was flown
    tried: tuple[str, ...] = ()  # a line for each thing that the script tried and the plan does not allow

    def of_script(self, script: str) -> Result:
        """Return the same result for a script with the same contents at another path."""
        old_folder, folder = os.path.dirname(self.script), os.path.dirname(script)
        error = self.error.replace(old_folder, folder) if self.error and old_folder else self.error
        return replace(self, script=script, error=error)

    @property
    def troubles(self) -> list[str]:
        """The error, and the forbidden things that the script tried, a line each."""
        return [*filter(None, [self.error]), *(f"the script {line}" for line in self.tried)]

    def to_json(self) -> dict[str, Any]:
        """Return the result as a dictionary for the module json."""
        return {**asdict(self), "tried": list(self.tried)}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Result:
        """Return the result in the dictionary of `to_json`. Raises ValueError for any other value."""
        try:
            outcomes = tuple(Outcome(**outcome) for outcome in values["outcomes"])
            plain = {field_.name: values[field_.name] for field_ in fields(cls)}
            return cls(**{**plain, "outcomes": outcomes, "tried": tuple(values["tried"])})
        except (KeyError, TypeError) as error:
            raise ValueError(f"no result of a flight: {error}") from None
