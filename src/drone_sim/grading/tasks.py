"""The package's own tasks: tasks/<name>/plan.yaml. See tasks/README.md."""

from __future__ import annotations

from pathlib import Path

from drone_sim.files.resources import is_file, package_path
from drone_sim.grading.plan import PlanError
from drone_sim.message_text import near_names, shown

_PLAN = "plan.yaml"


def names() -> list[str]:
    return sorted(plan.parent.name for plan in folder().glob(f"*/{_PLAN}"))


def folder() -> Path:
    """Return the folder of the tasks, in the source tree or installed under share/."""
    return package_path() / "tasks"


def find(name: str) -> Path:
    """Return the path of the plan with a name: a YAML file, a folder with a plan.yaml, or a task.

    Raises PlanError for any other name.
    """
    path = Path(name)
    if path.suffix.lower() in (".yaml", ".yml"):
        return path
    if name and is_file(path / _PLAN):
        return path / _PLAN
    known = names()
    if name in known:
        return folder() / name / _PLAN
    raise PlanError(f"{shown(name)}: no such plan: must be a file.yaml, or a task; {near_names(name, known)}")
