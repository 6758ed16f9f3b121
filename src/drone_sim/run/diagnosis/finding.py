"""What a look at one thing found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2  # as diagnostic_msgs/DiagnosticStatus counts


class Problem(NamedTuple):
    """One thing that is not as a user expects, in words that say what to do about it."""

    level: int
    what: str


class Finding(NamedTuple):
    """A name, the worst of the levels, one line, and the values that are known, by name."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


def finding(name: str, fine: str, problems: Sequence[Problem], values: Mapping[str, str]) -> Finding:
    """Return what was found: `fine` where there are no problems."""
    level = max((one.level for one in problems), default=OK)
    worst_first = sorted(problems, key=lambda one: -one.level)
    return Finding(name, level, "; ".join(one.what for one in worst_first) or fine, values)


def numbers(values: Sequence[float], digits: int = 2) -> str:
    """Return numbers in a row, with so many digits behind the point; no minus before a zero."""
    return " ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)
