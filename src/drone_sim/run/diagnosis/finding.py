"""Result of the diagnosis of one item: a vehicle, the cameras, or the simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2  # levels of diagnostic_msgs/DiagnosticStatus


class Problem(NamedTuple):
    """Unexpected condition, with a text that also says what to do about it."""

    level: int
    what: str


class Finding(NamedTuple):
    """Name, worst level, one-line message, and values by name, as in DiagnosticStatus."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


def finding(name: str, fine: str, problems: Sequence[Problem], values: Mapping[str, str]) -> Finding:
    """Return a finding with the worst problem first; its message is `fine` if there are no problems."""
    level = max((problem.level for problem in problems), default=OK)
    worst_first = sorted(problems, key=lambda problem: -problem.level)
    return Finding(name, level, "; ".join(problem.what for problem in worst_first) or fine, values)


def numbers(values: Sequence[float], digits: int = 2) -> str:
    """Return numbers separated by spaces, with `digits` decimals and no minus sign before a zero."""
    return " ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)
