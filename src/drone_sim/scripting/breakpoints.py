"""Lines of scripts at which a flight pauses, and what the scripts' variables were there."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

MOST_FILES, MOST_LINES = 50, 500  # with breakpoints; breakpoints of a file
MOST_ROWS, MOST_INSIDE = 200, 60  # variables of a scope; what is shown within one
LONGEST_NAME, LONGEST_VALUE = 60, 160  # characters


class Row(NamedTuple):
    """A variable as a person reads it: name, type, a short value, and what is within it, one level deep."""

    name: str
    type: str
    value: str
    inside: tuple[Row, ...] = ()

    def as_json(self) -> list[Any]:
        """Return it as JSON takes it."""
        return [self.name, self.type, self.value, [one.as_json() for one in self.inside]]


class Scope(NamedTuple):
    """Variables that stand in one place: `locals`, `self` or `globals`."""

    name: str
    rows: list[Row]

    def as_json(self) -> list[Any]:
        """Return it as JSON takes it."""
        return [self.name, [one.as_json() for one in self.rows]]


class Reached(NamedTuple):
    """A breakpoint that was reached: file, line, simulated time (s) at the step's beginning, and what was there."""

    file: str
    line: int
    time: float
    scopes: list[Scope]


class Breakpoints:
    """The breakpoints of all scripts of a simulation. Whoever plays it looks at `reached` after each step.

    A script that reaches one goes on to the end of its phase: what it computes, and so the flight, is the same.
    """

    def __init__(self, time: Callable[[], float] = lambda: 0.0):
        """Begin without any; `time` returns the simulated time in s."""
        self._time = time
        self._lines: dict[str, frozenset[int]] = {}  # by the real paths of files
        self._known: dict[str, frozenset[int]] = {}  # by the names that scripts have for their files
        self.reached: Reached | None = None  # the first one in the step

    def __bool__(self) -> bool:
        """Tell whether there are any."""
        return bool(self._lines)

    def set(self, lines: Mapping[str, frozenset[int]]) -> bool:
        """Replace all breakpoints by these lines (from 1), by the paths of files; return whether they differ."""
        wanted = {os.path.realpath(file): numbers for file, numbers in lines.items() if numbers}
        if wanted == self._lines:
            return False
        self._lines, self._known = wanted, {}
        return True

    def all(self) -> Mapping[str, frozenset[int]]:
        """Return the lines of all files, by their real paths."""
        return self._lines

    def lines(self, file: str) -> frozenset[int]:
        """Return those of a file."""
        found = self._known.get(file)
        if found is None:
            found = self._known[file] = self._lines.get(os.path.realpath(file), frozenset())
        return found

    def reach(self, file: str, line: int, scopes: Callable[[], list[Scope]]) -> None:
        """Remember that a line was reached, with what `scopes` returns, if it is the first one of the step."""
        if self.reached is None:
            self.reached = Reached(file, line, self._time(), scopes())


def read_breakpoints(given: Any) -> dict[str, frozenset[int]]:
    """Return the lines that `{"FILE": [LINE, ...]}` says. Raises ValueError, in one line."""
    if not isinstance(given, dict) or len(given) > MOST_FILES:
        raise ValueError(f"must be a mapping of at most {MOST_FILES} files to lists of lines")
    found = {}
    for file, lines in given.items():
        if not file.startswith("/") or "\0" in file:
            raise ValueError(f"{file[:80]!r}: must be the whole path of a file")
        if not isinstance(lines, list) or len(lines) > MOST_LINES or not all(type(one) is int for one in lines):
            raise ValueError(f"{file[:80]}: must have a list of at most {MOST_LINES} whole numbers")
        found[file] = frozenset(one for one in lines if one > 0)
    return found
