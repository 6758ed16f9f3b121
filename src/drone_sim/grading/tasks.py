"""Tasks: <name>/plan.yaml in the package's folder tasks, and in that of a course. See tasks/README.md."""

from __future__ import annotations

import os
from pathlib import Path

from drone_sim.files.resources import is_file, package_path
from drone_sim.grading.plan import PlanError
from drone_sim.message_text import near_names, shown

VARIABLE = "DRONE_SIM_TASKS"  # the folder of a course's tasks
_PLAN = "plan.yaml"


def names() -> list[str]:
    return sorted(folders())


def folder() -> Path:
    """Return the folder of the package's tasks, in the source tree or installed under share/."""
    return package_path() / "tasks"


def folders() -> dict[str, Path]:
    """Return the folder of each task; a course's task replaces one of the package with the same name."""
    course = os.environ.get(VARIABLE)
    groups = [folder(), *([Path(course)] if course else [])]
    return {plan.parent.name: plan.parent for group in groups for plan in group.glob(f"*/{_PLAN}")}


def find(name: str) -> Path:
    """Return the path of the plan with a name: a YAML file, a folder with a plan.yaml, or a task.

    Raises PlanError for any other name.
    """
    path = Path(name)
    if path.suffix.lower() in (".yaml", ".yml"):
        return path
    if name and is_file(path / _PLAN):
        return path / _PLAN
    known = folders()
    if name in known:
        return known[name] / _PLAN
    raise PlanError(f"{shown(name)}: no such plan: must be a file.yaml, or a task; {near_names(name, sorted(known))}")
