"""Results grouped by scripts and by criteria, and the formatting of labels and figures for all outputs."""

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
    """All flights of one script, at least one, sorted by seed."""

    script: str  # as in the results; '' is the built-in script
    label: str  # a name that is unique in these results: the author's, if it is known
    flights: tuple[Result, ...]

    @property
    def passed(self) -> int:
        return sum(flight.passed for flight in self.flights)

    @property
    def points(self) -> float:
        """The mean of the flights' points."""
        return sum(flight.points for flight in self.flights) / len(self.flights)

    @property
    def of(self) -> float:
        """The possible points of a flight."""
        return max(flight.of for flight in self.flights)

    @property
    def worst(self) -> Result:
        """The first of the flights with the fewest points."""
        return min(self.flights, key=lambda flight: (flight.points, flight.passed))

    @property
    def flown(self) -> float:
        """The simulated duration (s) of all flights together."""
        return sum(flight.flown for flight in self.flights)

    @property
    def failures(self) -> list[tuple[str, int]]:
        """The failed criteria and the number of flights in which each failed, the most frequent first."""
        named = (pair for flight in self.flights for pair in named_outcomes(flight))
        return Counter(name for name, outcome in named if not outcome.passed).most_common()

    @property
    def has_passed(self) -> bool:
        return self.passed == len(self.flights)

    @property
    def errors(self) -> list[str]:
        """The errors and forbidden actions of all flights, without duplicates."""
        return list(dict.fromkeys(line for flight in self.flights for line in self.errors_of(flight)))

    def errors_of(self, flight: Result) -> list[str]:
        """Return the error and the forbidden actions of a flight, with the script's name instead of its path."""
        name = PurePath(self.script).name
        return [line.replace(self.script, name) if self.script else line for line in flight.troubles]


def group_by_script(results: Iterable[Result], names: Mapping[str, str] | None = None) -> list[ScriptResults]:
    """Return results by script, in the order in which the scripts first occur.

    `names` are the names of the scripts' authors, as far as they are known.
    """
    flights: dict[str, list[Result]] = {}
    for result in results:
        flights.setdefault(result.script, []).append(result)
    labels = {**_unique_labels(list(flights)), **(names or {})}
    return [
        ScriptResults(script, labels[script], tuple(sorted(some, key=lambda flight: flight.seed)))
        for script, some in flights.items()
    ]


def _unique_labels(scripts: Sequence[str]) -> dict[str, str]:
    """Return the shortest ends of the scripts' paths that are different, such as alice/my.py and bob/my.py."""
    labels = {}
    for script in scripts:
        parts = PurePath(script).parts
        ends = ("/".join(parts[-length:]) for length in range(1, len(parts)))
        unique = (end for end in ends if sum(other == end or other.endswith(f"/{end}") for other in scripts) == 1)
        labels[script] = next(unique, script) or BUILT_IN
    return labels


def group_by_criterion(results: Iterable[Result]) -> dict[str, list[Outcome]]:
    """Return the outcomes of each criterion in all flights, in the order of the plan."""
    outcomes: dict[str, list[Outcome]] = {}
    for result in results:
        for name, outcome in named_outcomes(result):
            outcomes.setdefault(name, []).append(outcome)
    return outcomes


def named_outcomes(result: Result) -> list[tuple[str, Outcome]]:
    """Return the outcomes with unique names: the second of two named `reach` is `reach (2)`."""
    count: Counter[str] = Counter()
    named = []
    for outcome in result.outcomes:
        count[outcome.name] += 1
        named.append((outcome.name if count[outcome.name] == 1 else f"{outcome.name} ({count[outcome.name]})", outcome))
    return named


def flight_label(result: Result) -> str:
    """Return the seed and the changes of a flight, such as `seed 3, control.Kzref=2`."""
    changes = ", ".join(f"{key}={value}" for key, value in flattened(result.changes))
    return f"seed {result.seed}{f', {changes}' if changes else ''}"


def align_columns(rows: Sequence[Sequence[str]], left: int = 0) -> list[str]:
    """Return rows as lines with columns two spaces apart: the first `left` flush left, the others flush right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    aligned = [str.ljust] * left + [str.rjust] * (len(widths) - left)
    return ["  ".join(align(cell, width) for align, cell, width in zip(aligned, row, widths)) for row in rows]


def format_points(value: float) -> str:
    """Return points with at most two decimals."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def format_figure(outcome: Outcome) -> str:
    """Return the figure of an outcome with three digits (below 0.1: two) and its unit, '' if there is none."""
    if outcome.value is None:
        return ""
    size = abs(outcome.value)
    number = (
        f"{outcome.value:.0f}" if size >= 100 else f"{outcome.value:.3g}" if size >= 0.1 else f"{outcome.value:.2g}"
    )
    return f"{number} {outcome.unit}".rstrip()


def describe(outcome: Outcome) -> str:
    """Return a sentence about an outcome, with the time of a failure."""
    sentence = outcome.said or ", ".join(filter(None, (format_figure(outcome), outcome.allowed)))
    when = f"{outcome.at:.2f} s" if outcome.at is not None and not outcome.passed else ""
    return f"{sentence} (at {when})" if when and when not in sentence else sentence
