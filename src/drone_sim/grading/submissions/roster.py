"""A table of a class: a CSV with the columns `name` and `path`, and where somebody needs them `id` and `email`."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from pathlib import Path

from drone_sim.grading.jobs.files import Unreadable, read
from drone_sim.grading.submissions.submission import Person, Submission
from drone_sim.message_text import shown

_LARGEST = 2**20  # bytes
_COLUMNS = ("name", "path")
_MORE = ("id", "email")
_DELIMITERS = ",;\t"  # a spreadsheet's is that of its country


def listed(path: Path) -> list[Submission]:
    """Return a submission for every path in the table, relative to its folder; a group's are rows of the same path.

    Raises ValueError, in one line that names file and line.
    """
    found: dict[str, tuple[Person, ...]] = {}
    try:
        for person, name in _rows(path):
            script = os.path.normpath(path.absolute().parent / name)
            found[script] = (*found.get(script, ()), person)
    except csv.Error as error:
        raise ValueError(f"{path}: is not a table that can be read: {error}") from None
    return [
        Submission(script, people, "" if os.path.lexists(script) else f"{script}: no such file")
        for script, people in found.items()
    ]


def _rows(path: Path) -> Iterator[tuple[Person, str]]:
    try:
        lines = read(path, _LARGEST).decode("utf-8-sig").splitlines()
    except (Unreadable, UnicodeDecodeError) as error:
        said = str(error) if isinstance(error, Unreadable) else f"{path}: must be text in UTF-8"
        raise ValueError(said) from None
    header = lines[0] if lines else ""
    table = csv.DictReader(lines, delimiter=max(_DELIMITERS, key=header.count), restval="")
    names = {(name or "").strip().lower(): name for name in table.fieldnames or ()}
    if not {*_COLUMNS} <= {*names}:
        told = f"must name the columns {', '.join(_COLUMNS)} (and may {', '.join(_MORE)}), not {shown(header)}"
        raise ValueError(f"{path}: line 1: {told}")
    for row in table:
        values = {key: str(row[names[key]]).strip() if key in names else "" for key in (*_COLUMNS, *_MORE)}
        if not (values["name"] and values["path"]):
            raise ValueError(f"{path}: line {table.line_num}: must have a name and a path")
        yield Person(values["name"], id=values["id"], email=values["email"]), values["path"]
