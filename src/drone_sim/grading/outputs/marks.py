"""The marks of a class in a CSV file that Moodle imports.

The columns are those of Moodle's offline grading worksheet with their English names. Moodle's assignments identify
people by `Identifier`, its gradebook and other systems by name, number or address.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from drone_sim.files import writing
from drone_sim.grading.outputs.script_results import ScriptResults, format_points
from drone_sim.grading.submissions.submission import Person, Submission
from drone_sim.message_text import encodable, printable

COLUMNS = (
    *("Identifier", "Full name", "ID number", "Email address"),
    *("Grade", "Maximum Grade", "Last modified (grade)", "Feedback comments"),
)
_NEVER = "-"  # Moodle's mark for no time
_MAX_ERROR = 400  # characters
_LOAD_ERROR = "[load] "  # prefix of a ScriptError for a syntax error or a missing module
_FORMULA_PREFIXES = ("=", "+", "-", "@")  # of cells that a spreadsheet evaluates


def write(submissions: Iterable[Submission], scripts: Sequence[ScriptResults], path: str | Path) -> None:
    """Write a line for each person, or for each script whose people are unknown, with the mean of the flights' points.

    Raises OSError, which names the file.
    """
    results = {script.script: script for script in scripts}
    with writing.replacing(path) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for submission in submissions:
            if result := results.get(submission.script):
                grades = (
                    format_points(result.points),
                    format_points(result.of),
                    _NEVER,
                    feedback(result, submission.error),
                )
                for person in submission.people or (Person(result.label),):
                    identifier = f"Participant {person.participant}" if person.participant else ""
                    table.writerow(map(_cell, (identifier, person.name, person.id, person.email, *grades)))


def feedback(result: ScriptResults, error: str = "") -> str:
    """Return one line about a script, the same for every run; `error` is the reason why a submission has no script.

    Only errors of loading are quoted. Other errors are counted, because they may differ: on a busy machine, another
    limit may stop an endless script.
    """
    if error or all((flight.error or "").startswith(_LOAD_ERROR) for flight in result.flights):
        return f"not flown: {error or result.errors[0]:.{_MAX_ERROR}}"
    failed = ", ".join(f"{name} in {count}" for name, count in result.failures)
    parts = [f"{result.passed} of {len(result.flights)} flights passed", failed and f"failed: {failed}"]
    errors = sum(flight.error is not None for flight in result.flights)
    tried = [line for flight in result.flights for line in flight.tried][:1]
    return "; ".join(filter(None, [*parts, f"ended by an error: {errors}" if errors else "", *tried]))


def _cell(text: str) -> str:
    """Return a cell that no spreadsheet evaluates as a formula."""
    plain = encodable(printable(text))
    return f"'{plain}" if plain.startswith(_FORMULA_PREFIXES) and plain != _NEVER else plain
