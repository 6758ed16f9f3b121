"""A flight back from the table that `fly --csv` wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from drone_sim.offline.recording import COLUMNS, Recording
from drone_sim.wording import shown

MAX_ROWS = 500_000  # as many as are drawn
LARGEST = 1e9  # m, m/s, ...: nothing is there, and no axis goes so far
_LONGEST = 10_000  # characters of a line
_Row = tuple[float, ...]


class TableRefused(ValueError):
    """A table cannot be read; one line that names the file, the line (from 1) and what is wrong."""


def read(path: str | Path) -> Recording:
    """Return the flight in a table. Raises OSError and TableRefused."""
    with open(path, encoding="utf-8") as file:
        try:
            rows = _rows(file)
        except UnicodeDecodeError:
            raise TableRefused(f"{path}: is no text") from None
        except TableRefused as refused:
            raise TableRefused(f"{path}: {refused}") from None
    recording = Recording()
    recording.rows = rows
    return recording


def _rows(file: TextIO) -> list[_Row]:
    header = file.readline(_LONGEST)
    if not header:
        raise TableRefused("is empty")
    if header.rstrip("\r\n").split(",") != list(COLUMNS):
        there = shown(header.strip()[:60])
        raise TableRefused(f"line 1 is {there}: a table of `fly --csv` begins with {COLUMNS[0]},{COLUMNS[1]},...")
    rows: list[_Row] = []
    while line := file.readline(_LONGEST):
        number = len(rows) + 2
        if len(rows) == MAX_ROWS:
            raise TableRefused(f"has more than {MAX_ROWS} rows")
        rows.append(_row(line, number))
        if number > 2 and rows[-1][0] <= rows[-2][0]:
            raise TableRefused(f"line {number}: the time {rows[-1][0]:g} s is not after {rows[-2][0]:g} s")
    if not rows:
        raise TableRefused("has a header and no rows")
    return rows


def _row(line: str, number: int) -> _Row:
    fields = line.rstrip("\r\n").split(",")
    if len(fields) != len(COLUMNS) or not line.endswith("\n"):
        raise TableRefused(f"line {number}: is cut off, or not of this table: {len(fields)} of {len(COLUMNS)} fields")
    try:
        row = tuple(map(float, fields))
    except ValueError as error:
        raise TableRefused(f"line {number}: {error!s:.80}") from None
    if not all(abs(value) < LARGEST for value in row):
        raise TableRefused(f"line {number}: must hold numbers below {LARGEST:g}")
    return row
