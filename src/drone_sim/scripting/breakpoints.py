"""Breakpoints: lines of scripts at which a flight pauses, with the values of the variables there."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

MOST_FILES, MOST_LINES = 50, 500  # with breakpoints; breakpoints of a file
MOST_ROWS, MOST_INSIDE = 200, 60  # variables of a scope; what is shown within one
LONGEST_NAME, LONGEST_VALUE = 60, 160  # characters


class Row(NamedTuple):
    """A variable in readable form: name, type, a short value, and the values inside it, one level deep."""

    name: str
    type: str
    value: str
    inside: tuple[Row, ...] = ()

    def as_json(self) -> list[Any]:
        return [self.name, self.type, self.value, [row.as_json() for row in self.inside]]


class Scope(NamedTuple):
    """Variables of one scope: `locals`, `self` or `globals`."""

    name: str
    rows: list[Row]

    def as_json(self) -> list[Any]:
        return [self.name, [row.as_json() for row in self.rows]]


class Reached(NamedTuple):
    """A breakpoint that was reached: file, line, simulated time (s) at the beginning of the step, and variables."""

    file: str
    line: int
    time: float
    scopes: list[Scope]


class Breakpoints:
    """The breakpoints of all scripts of a simulation. The player reads `reached` after each step.

    A script that reaches a breakpoint continues to the end of its phase, so breakpoints do not change the flight.
    """

    def __init__(self, time: Callable[[], float] = lambda: 0.0):
        """Create it without breakpoints; `time` returns the simulated time in s."""
        self._time = time
        self._lines: dict[str, frozenset[int]] = {}  # by the real paths of files
        self._known: dict[str, frozenset[int]] = {}  # by the paths that scripts use for their files
        self.reached: Reached | None = None  # the first one in the step

    def __bool__(self) -> bool:
        return bool(self._lines)

    def set(self, lines: Mapping[str, frozenset[int]]) -> bool:
        """Replace all breakpoints by these lines (from 1) of files; return whether they have changed."""
        new = {os.path.realpath(file): numbers for file, numbers in lines.items() if numbers}
        if new == self._lines:
            return False
        self._lines, self._known = new, {}
        return True

    def all(self) -> Mapping[str, frozenset[int]]:
        """Return the lines of all files, by their real paths."""
        return self._lines

    def lines(self, file: str) -> frozenset[int]:
        if file not in self._known:
            self._known[file] = self._lines.get(os.path.realpath(file), frozenset())
        return self._known[file]

    def reach(self, file: str, line: int, scopes: Callable[[], list[Scope]]) -> None:
        """Store that a line was reached, with the result of `scopes`, if it is the first one in the step."""
        if self.reached is None:
            self.reached = Reached(file, line, self._time(), scopes())


def read_breakpoints(files: Any) -> dict[str, frozenset[int]]:
    """Return the lines by file from `{"FILE": [LINE, ...]}`. Raises ValueError with a one-line message."""
    if not isinstance(files, dict) or len(files) > MOST_FILES:
        raise ValueError(f"must be a mapping of at most {MOST_FILES} files to lists of lines")
    found = {}
    for file, lines in files.items():
        if not file.startswith("/") or "\0" in file:
            raise ValueError(f"{file[:80]!r}: must be the whole path of a file")
        if not isinstance(lines, list) or len(lines) > MOST_LINES or not all(type(line) is int for line in lines):
            raise ValueError(f"{file[:80]}: must have a list of at most {MOST_LINES} whole numbers")
        found[file] = frozenset(line for line in lines if line > 0)
    return found
