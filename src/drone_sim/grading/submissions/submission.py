"""A submission: a script, and the people who have handed it in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass


class Refused(ValueError):
    """A submission cannot be graded; one line says why. Other submissions can."""


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
