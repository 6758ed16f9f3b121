"""How Moodle and Gradescope name what they export, and what Gradescope says beside it of who has handed in."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from drone_sim.grading.jobs.files import read
from drone_sim.grading.submissions.archive import Parts
from drone_sim.grading.submissions.submission import Person

METADATA = "submission_metadata.yml"
_LARGEST = 64 * 2**20  # bytes: it repeats what the autograder has said
_MOST_PEOPLE = 20  # of a group
_GRADESCOPE = re.compile(r"submission_\d+")
# Moodle's folder of somebody's files, or the beginning of each file's name where the export has no folders. The name is
# the shortest possible: a student may call a file `Bob_8_assignsubmission_file_my.py`.
_MOODLE = re.compile(r"(?P<name>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*))?", re.DOTALL)
_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # every value is text, and no tag makes anything else


def arranged(paths: Sequence[Parts]) -> list[tuple[str, Parts]]:
    """Return for each path in a class's zip the part that it belongs to, and its path in there: () for a mere file."""
    first = {parts[0] for parts in paths}
    if len(first) == 1 and any(len(parts) > 1 for parts in paths) and not _is_somebodys(*first):
        paths = [parts[1:] or parts for parts in paths]  # a folder around all of them, such as Gradescope's
    return [_arranged(parts) for parts in paths]


def _is_somebodys(name: str) -> bool:
    return bool(_MOODLE.fullmatch(name) or _GRADESCOPE.fullmatch(name))


def _arranged(parts: Parts) -> tuple[str, Parts]:
    found = _MOODLE.fullmatch(parts[0])
    if found is None:
        return parts[0], parts[1:]
    inside = parts[1:] if len(parts) > 1 else (found["file"] or "",)
    return f"{found['name']}_{found['number']}_assignsubmission_file_", inside


def person_of(name: str) -> Person | None:
    """Return to whom a folder or a file belongs, from the name that Moodle gives it; None for another name."""
    found = _MOODLE.fullmatch(name)
    return None if found is None else Person(found["name"], found["number"])


def people_in(folder: Path) -> dict[str, tuple[Person, ...]]:
    """Return who has handed in what lies in each subfolder, as Gradescope's file in a folder says; {} without one.

    Raises ValueError, in one line, for a file that says something else.
    """
    path = folder / METADATA
    if not path.is_file():
        return {}
    try:
        content = yaml.load(read(path, _LARGEST), _LOADER)
        return {str(name): tuple(map(_person, one[":submitters"][:_MOST_PEOPLE])) for name, one in content.items()}
    except (yaml.YAMLError, RecursionError, AttributeError, KeyError, TypeError):
        raise ValueError(f"{path}: does not say who the `:submitters:` are, as Gradescope's file does") from None


def _person(said: Mapping[str, Any]) -> Person:
    values = said[":name"], said.get(":sid", ""), said.get(":email", "")
    if not all(isinstance(one, str) for one in values):  # lists of aliases of lists would be long texts
        raise TypeError
    name, number, email = values
    return Person(name, id=number, email=email)
