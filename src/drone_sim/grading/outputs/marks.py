"""The marks of a class, as Moodle imports them.

The columns that Moodle's offline grading worksheet has, under its English names: it knows people by `Identifier`, and a
gradebook by name, number or address. One that others import has these at least.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from drone_sim.files import writing
from drone_sim.grading.outputs.by_script import ScriptResults, points
from drone_sim.grading.submissions.submission import Person, Submission
from drone_sim.message_text import encodable, printable

COLUMNS = (
    *("Identifier", "Full name", "ID number", "Email address"),
    *("Grade", "Maximum Grade", "Last modified (grade)", "Feedback comments"),
)
_NEVER = "-"  # as Moodle writes a time that there is none of
_LONGEST = 400  # characters of an error
_NOT_LOADED = "[load] "  # how ScriptError begins for a syntax error, or for a module that is not there
_FORMULAS = ("=", "+", "-", "@")  # what a spreadsheet takes for one


def write(submissions: Iterable[Submission], scripts: Sequence[ScriptResults], path: str | Path) -> None:
    """Write a line for each person, or for a submission's script if it has none. Raises OSError, which names the file.

    The mark is the mean of the flights' points.
    """
    results = {one.script: one for one in scripts}
    with writing.replacing(path) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for one in submissions:
            if result := results.get(one.script):
                for person in one.people or (Person(result.label),):
                    table.writerow(map(_cell, _row(person, result, one.error)))


def _row(person: Person, result: ScriptResults, error: str) -> tuple[str, ...]:
    identifier = f"Participant {person.participant}" if person.participant else ""
    grades = points(result.points), points(result.of), _NEVER
    return identifier, person.name, person.id, person.email, *grades, feedback(result, error)


def feedback(result: ScriptResults, error: str = "") -> str:
    """Return how a script has done, in one line, the same every time; `error` is why a submission has no script.

    A script that cannot be loaded has its error named, too. Other errors are counted: the report has them, and a busy
    machine may stop an endless script by another limit.
    """
    if error or all((one.error or "").startswith(_NOT_LOADED) for one in result.flights):
        return f"not flown: {error or result.errors[0]:.{_LONGEST}}"
    failed = ", ".join(f"{name} in {count}" for name, count in result.failures)
    said = [f"{result.passed} of {len(result.flights)} flights passed", failed and f"failed: {failed}"]
    errors = sum(one.error is not None for one in result.flights)
    tried = [line for one in result.flights for line in one.tried][:1]
    return "; ".join(filter(None, [*said, f"ended by an error: {errors}" if errors else "", *tried]))


def _cell(text: str) -> str:
    """Return a cell that every spreadsheet takes for text, not for a formula."""
    plain = encodable(printable(text))
    return f"'{plain}" if plain.startswith(_FORMULAS) and plain != _NEVER else plain
