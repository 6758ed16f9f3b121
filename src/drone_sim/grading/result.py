"""What one graded flight gives: an outcome for each criterion, with the figure behind it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """How one criterion came out."""

    name: str
    kind: str
    passed: bool
    value: float | None  # the figure, in `unit`; None where there is none, as of what never happened
    unit: str  # '' for a count
    allowed: str  # what the figure may be, such as 'at most 1.5 s'
    points: float  # that it gives, of the `of` that can be had
    of: float
    at: float | None  # s of simulated time at which it was decided; None where it is no matter of a moment
    said: str  # one sentence, with the figure


@dataclass(frozen=True)
class Result:
    """How one flight of a plan came out; to and from JSON without a loss."""

    plan: str
    script: str  # '' is the built-in one
    seed: int
    changes: Mapping[str, Any]  # keys of config/drone.yaml, laid over the plan's
    passed: bool
    points: float
    of: float
    flown: float  # s of simulated time
    error: str | None  # one line; None where the flight came to its end
    outcomes: tuple[Outcome, ...] = field(default=())
    digest: str = ""  # SHA-256 of the table's numbers, as little-endian doubles; '' where nothing was flown
    tried: tuple[str, ...] = ()  # what the script tried that the plan does not allow, in one line each

    def with_tried(self, tried: Sequence[str]) -> Result:
        """Return the result with the forbidden things that the script tried; such a flight is not passed."""
        return replace(self, tried=tuple(tried), passed=self.passed and not tried)

    def of_script(self, script: str) -> Result:
        """Return it as of a script in another place, with the same contents."""
        before, folder = os.path.dirname(self.script), os.path.dirname(script)
        error = self.error.replace(before, folder) if self.error and before else self.error
        return replace(self, script=script, error=error)

    @property
    def troubles(self) -> list[str]:
        """What went wrong beside the criteria, in one line each: the error, and what was tried."""
        return [*filter(None, [self.error]), *(f"the script {one}" for one in self.tried)]

    def to_json(self) -> dict[str, Any]:
        """Return it as what the module json writes: an infinite or undefined figure is None."""
        return {**asdict(self), "tried": list(self.tried)}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Result:
        """Return what `to_json` gave. Raises ValueError for anything else."""
        try:
            outcomes = tuple(Outcome(**one) for one in values["outcomes"])
            own = {one.name: values[one.name] for one in fields(cls)}
            return cls(**{**own, "outcomes": outcomes, "tried": tuple(values["tried"])})
        except (KeyError, TypeError) as error:
            raise ValueError(f"no result of a flight: {error}") from None


def result_of(
    plan: str,
    script: str,
    seed: int,
    changes: Mapping[str, Any],
    outcomes: tuple[Outcome, ...],
    flown: float = 0.0,
    error: str | None = None,
    digest: str = "",
) -> Result:
    """Return the result of a flight: passed where every criterion is, and nothing went wrong."""
    passed = error is None and all(one.passed for one in outcomes)
    points, of = sum(one.points for one in outcomes), sum(one.of for one in outcomes)
    return Result(plan, script, seed, dict(changes), passed, points, of, flown, error, outcomes, digest)
