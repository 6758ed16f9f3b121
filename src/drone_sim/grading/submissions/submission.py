"""A submission: whose it is, and the script that is to be flown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass


class Refused(ValueError):
    """What somebody has handed in cannot be graded; one line says why. Others' can."""


@dataclass(frozen=True)
class Person:
    """Somebody who has handed in, as the course's system knows them; '' stands for unknown."""

    name: str
    participant: str = ""  # Moodle's number of them in the assignment
    id: str = ""  # the student's number
    email: str = ""


@dataclass(frozen=True)
class Submission:
    """A script, or why there is none; of a group it has several people, of a mere file none."""

    script: str  # as `grade` takes it; where there is none to fly, what was looked through
    people: tuple[Person, ...] = ()
    error: str = ""  # in one line

    @property
    def name(self) -> str:
        """Whose it is; '' where nobody has said."""
        return ", ".join(one.name for one in self.people)


def names_of(submissions: Iterable[Submission]) -> Mapping[str, str]:
    """Return for each script the name of its author, made unique: people of the same name get a number, too."""
    named = [one for one in submissions if one.people]
    count = Counter(one.name for one in named)
    return {
        one.script: one.name if count[one.name] == 1 else f"{one.name} ({one.people[0].participant or place})"
        for place, one in enumerate(named, start=1)
    }
