"""The tasks of a course, which come with the package: tasks/<name>/plan.yaml. See tasks/README.md."""

from __future__ import annotations

from pathlib import Path

from drone_sim.files.resources import is_file, package_path
from drone_sim.grading.plan import PlanError
from drone_sim.message_text import near_names, shown

_PLAN = "plan.yaml"


def names() -> list[str]:
    """Return the names of all tasks, sorted."""
    return sorted(plan.parent.name for plan in folder().glob(f"*/{_PLAN}"))


def folder() -> Path:
    """Return the folder of the tasks, in the source tree or installed under share/."""
    return package_path() / "tasks"


def find(name: str) -> Path:
    """Return the path of a plan: of a task by its name, in a folder that holds a plan.yaml, or a file as it is given.

    Raises PlanError, in one line with near names, for a name that is none of these.
    """
    given = Path(name)
    if given.suffix.lower() in (".yaml", ".yml"):
        return given
    if name and is_file(given / _PLAN):
        return given / _PLAN
    known = names()
    if name in known:
        return folder() / name / _PLAN
    raise PlanError(f"{shown(name)}: no such plan: must be a file.yaml, or a task; {near_names(name, known)}")
