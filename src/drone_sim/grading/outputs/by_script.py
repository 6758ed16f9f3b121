"""Results in the order in which people ask for them: whose script, how many flights passed, which was the worst."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from drone_sim.config.types import flattened
from drone_sim.grading.result import Outcome, Result

BUILT_IN = "(built-in)"


@dataclass(frozen=True)
class ScriptResults:
    """All flights of one script, at least one, by seed."""

    script: str  # as the results name it, '' is the built-in one
    label: str  # its name for people, which no other script of these results has: whose it is, if that is known
    flights: tuple[Result, ...]

    @property
    def passed(self) -> int:
        """How many flights passed."""
        return sum(one.passed for one in self.flights)

    @property
    def points(self) -> float:
        """The mean of the flights' points."""
        return sum(one.points for one in self.flights) / len(self.flights)

    @property
    def of(self) -> float:
        """The points that a flight can give."""
        return max(one.of for one in self.flights)

    @property
    def worst(self) -> Result:
        """The flight with the fewest points; of several the first."""
        return min(self.flights, key=lambda one: (one.points, one.passed))

    @property
    def flown(self) -> float:
        """Simulated seconds, of all flights together."""
        return sum(one.flown for one in self.flights)

    @property
    def failures(self) -> list[tuple[str, int]]:
        """Criteria that failed and in how many flights, the most frequent first."""
        named = (pair for flight in self.flights for pair in named_outcomes(flight))
        return Counter(name for name, outcome in named if not outcome.passed).most_common()

    @property
    def has_passed(self) -> bool:
        """Whether every flight passed."""
        return self.passed == len(self.flights)

    @property
    def errors(self) -> list[str]:
        """What went wrong in the flights beside criteria, each once."""
        return list(dict.fromkeys(line for one in self.flights for line in self.told(one)))

    def told(self, flight: Result) -> list[str]:
        """Return what went wrong in a flight beside criteria, with the script's name instead of its path."""
        name = PurePath(self.script).name
        return [one.replace(self.script, name) if self.script else one for one in flight.troubles]


def by_script(results: Iterable[Result], names: Mapping[str, str] | None = None) -> list[ScriptResults]:
    """Return results by script, in the order in which the scripts first come; flights by seed, then as they come.

    `names` are those of the people whose scripts they are, as far as they are known.
    """
    flights: dict[str, list[Result]] = {}
    for one in results:
        flights.setdefault(one.script, []).append(one)
    labels = {**_labels(list(flights)), **(names or {})}
    return [
        ScriptResults(script, labels[script], tuple(sorted(some, key=lambda one: one.seed)))
        for script, some in flights.items()
    ]


def flight_label(result: Result) -> str:
    """Return what tells a flight from the others of its script: `seed 3`, and what was changed."""
    changes = ", ".join(f"{key}={value}" for key, value in flattened(result.changes))
    return f"seed {result.seed}{f', {changes}' if changes else ''}"


def named_outcomes(result: Result) -> list[tuple[str, Outcome]]:
    """Return the outcomes, each with a name that no other has: of two called `reach` the second is `reach (2)`."""
    seen: Counter[str] = Counter()
    named = []
    for one in result.outcomes:
        seen[one.name] += 1
        named.append((one.name if seen[one.name] == 1 else f"{one.name} ({seen[one.name]})", one))
    return named


@dataclass(frozen=True)
class CriterionResults:
    """One criterion in all flights that it was asked of."""

    name: str
    kind: str
    allowed: str
    of: float
    passed: int
    flights: int


def criteria_of(results: Iterable[Result]) -> list[CriterionResults]:
    """Return how often each criterion was passed, in the order of the plan."""
    found: dict[str, list[Outcome]] = {}
    for result in results:
        for name, one in named_outcomes(result):
            found.setdefault(name, []).append(one)
    return [
        CriterionResults(name, some[0].kind, some[0].allowed, some[0].of, sum(one.passed for one in some), len(some))
        for name, some in found.items()
    ]


def in_columns(rows: Sequence[Sequence[str]], left: int = 0) -> list[str]:
    """Return rows as lines, their columns two spaces apart, so many of them flush left."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    aligned = [str.ljust] * left + [str.rjust] * (len(widths) - left)
    return ["  ".join(align(cell, width) for align, cell, width in zip(aligned, row, widths)) for row in rows]


def number(value: float) -> str:
    """Return a figure as people read it: three digits that count, and no more zeros than needed."""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def points(value: float) -> str:
    """Return points with two decimals at most."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def figure(outcome: Outcome) -> str:
    """Return the figure behind an outcome with its unit, '' where there is none."""
    return "" if outcome.value is None else f"{number(outcome.value)} {outcome.unit}".rstrip()


def describe(outcome: Outcome) -> str:
    """Return how a criterion came out, in a sentence, with the time of a failure."""
    said = outcome.said or ", ".join(filter(None, (figure(outcome), outcome.allowed)))
    when = f"{outcome.at:.2f} s" if outcome.at is not None and not outcome.passed else ""
    return f"{said} (at {when})" if when and when not in said else said


def _labels(scripts: Sequence[str]) -> dict[str, str]:
    """Return the shortest ends of the scripts' paths that are different, such as alice/my.py and bob/my.py."""
    labels = {}
    for script in scripts:
        parts = PurePath(script).parts
        ends = ("/".join(parts[-length:]) for length in range(1, len(parts)))
        labels[script] = next((end for end in ends if _is_only_one(end, scripts)), script) or BUILT_IN
    return labels


def _is_only_one(end: str, scripts: Iterable[str]) -> bool:
    return sum(script == end or script.endswith(f"/{end}") for script in scripts) == 1
