"""A submission: a script and its authors, as exports of Moodle and Gradescope, or a table in CSV, name them."""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from drone_sim.grading.jobs.files import read
from drone_sim.grading.submissions.archive import Parts
from drone_sim.message_text import shown

METADATA = "submission_metadata.yml"
_MAX_METADATA = 64 * 2**20  # bytes; the file repeats the autograder's output
_MAX_GROUP = 20  # people
_GRADESCOPE = re.compile(r"submission_\d+")
# Moodle's name of a student's folder, or the prefix of each file if the export has no folders. The name is the shortest
# possible match, because a student may call a file `Bob_8_assignsubmission_file_my.py`.
_MOODLE = re.compile(r"(?P<name>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*))?", re.DOTALL)
_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # every value is text, and tags create no objects
_MAX_TABLE = 2**20  # bytes
_REQUIRED_COLUMNS, _OPTIONAL_COLUMNS = ("name", "path"), ("id", "email")
_DELIMITERS = ",;\t"  # spreadsheets use the one of their country


@dataclass(frozen=True)
class Person:
    """A student as the course's system knows them; '' stands for unknown."""

    name: str
    participant: str = ""  # Moodle's number of the student in the assignment
    id: str = ""  # the student's number
    email: str = ""


@dataclass(frozen=True)
class Submission:
    """A script, or the reason why there is none. A group's has several people, a file without a name has none."""

    script: str  # as `grade` accepts it; without a script, the path that was searched
    people: tuple[Person, ...] = ()
    error: str = ""  # in one line

    @property
    def name(self) -> str:
        """The names of the people, '' if they are unknown."""
        return ", ".join(person.name for person in self.people)


def names_of(submissions: Iterable[Submission]) -> Mapping[str, str]:
    """Return the unique name of each script's author; people with the same name also get a number."""
    named = [submission for submission in submissions if submission.people]
    count = Counter(submission.name for submission in named)
    return {
        submission.script: submission.name
        if count[submission.name] == 1
        else f"{submission.name} ({submission.people[0].participant or number})"
        for number, submission in enumerate(named, start=1)
    }


# ---- exports of a course


def split_into_submissions(paths: Sequence[Parts]) -> list[tuple[str, Parts]]:
    """Return for each path in a class's zip its submission, and the path inside that: () for a single file."""
    top_level = {parts[0] for parts in paths}
    if len(top_level) == 1 and any(len(parts) > 1 for parts in paths):
        (name,) = top_level
        if not (_MOODLE.fullmatch(name) or _GRADESCOPE.fullmatch(name)):
            paths = [parts[1:] or parts for parts in paths]  # a folder around all submissions, such as Gradescope's
    submissions = []
    for name, *inside in paths:
        if match := _MOODLE.fullmatch(name):
            name = f"{match['name']}_{match['number']}_assignsubmission_file_"
            inside = inside or [match["file"] or ""]
        submissions.append((name, tuple(inside)))
    return submissions


def people_of(name: str) -> tuple[Person, ...]:
    """Return the person in Moodle's name of a folder or file; () for any other name."""
    match = _MOODLE.fullmatch(name)
    return (Person(match["name"], match["number"]),) if match else ()


def people_in(folder: Path) -> dict[str, tuple[Person, ...]]:
    """Return the people of each subfolder according to Gradescope's metadata file; {} if there is no such file.

    Raises ValueError, in one line, for a file with other content.
    """
    path = folder / METADATA
    if not path.is_file():
        return {}
    try:
        content = yaml.load(read(path, _MAX_METADATA), _LOADER)
        return {
            str(name): tuple(map(_gradescope_person, one[":submitters"][:_MAX_GROUP])) for name, one in content.items()
        }
    except (yaml.YAMLError, RecursionError, AttributeError, KeyError, TypeError):
        raise ValueError(
            f"{path}: must name the `:submitters:` of each submission, as Gradescope's file does"
        ) from None


def _gradescope_person(submitter: Mapping[str, Any]) -> Person:
    values = submitter[":name"], submitter.get(":sid", ""), submitter.get(":email", "")
    if not all(isinstance(value, str) for value in values):  # nested aliases of lists would be huge as text
        raise TypeError
    name, number, email = values
    return Person(name, id=number, email=email)


def read_table(path: Path) -> list[Submission]:
    """Return a submission for every path in a CSV with the columns `name` and `path`, and optionally `id` and `email`.

    Paths are relative to the table's folder; the people of a group are rows with the same path. Raises ValueError, in
    one line that names file and line.
    """
    people: dict[str, tuple[Person, ...]] = {}
    try:
        for person, name in _table_rows(path):
            script = os.path.normpath(path.absolute().parent / name)
            people[script] = (*people.get(script, ()), person)
    except csv.Error as error:
        raise ValueError(f"{path}: is not a table that can be read: {error}") from None
    return [
        Submission(script, group, "" if os.path.lexists(script) else f"{script}: no such file")
        for script, group in people.items()
    ]


def _table_rows(path: Path) -> Iterator[tuple[Person, str]]:
    try:
        lines = read(path, _MAX_TABLE).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{path}: must be text in UTF-8") from None
    header = lines[0] if lines else ""
    table = csv.DictReader(lines, delimiter=max(_DELIMITERS, key=header.count), restval="")
    names = {(name or "").strip().lower(): name for name in table.fieldnames or ()}
    if not {*_REQUIRED_COLUMNS} <= {*names}:
        columns = f"{', '.join(_REQUIRED_COLUMNS)} (and may {', '.join(_OPTIONAL_COLUMNS)})"
        raise ValueError(f"{path}: line 1: must name the columns {columns}, not {shown(header)}")
    for row in table:
        name, script, number, email = (
            str(row[names[key]]).strip() if key in names else "" for key in (*_REQUIRED_COLUMNS, *_OPTIONAL_COLUMNS)
        )
        if not (name and script):
            raise ValueError(f"{path}: line {table.line_num}: must have a name and a path")
        yield Person(name, id=number, email=email), script
