"""Everything, for programs: one JSON object with a version."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading import evidence
from drone_sim.grading.outputs.by_script import by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

FORMAT = "drone_sim grades"
VERSION = 1  # of the format: another one where a key is renamed or means something else, not where one comes


def write(
    plan: Plan,
    results: Sequence[Result],
    path: str | Path,
    key: bytes | None = None,
    names: Mapping[str, str] | None = None,
) -> None:
    """Write the file, signed by a key if there is one. Raises OSError, in one line that names it."""
    said = content(plan, results, names)
    said = said if key is None else evidence.signed(said, key)
    writing.write(path, json.dumps(said, indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result], names: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return what the file holds; a figure that is no finite number is null."""
    scripts = [
        {
            "script": one.script,
            "name": one.label,
            "flights": len(one.flights),
            "passed": one.passed,
            "points": one.points,
            "of": one.of,
            "worst": {"seed": one.worst.seed, "points": one.worst.points},
            "failed": dict(one.failures),
            "hashes": evidence.hashes_of(plan, one.script),
        }
        for one in by_script(results, names)
    ]
    return finite(
        {
            "format": FORMAT,
            "version": VERSION,
            "plan": {"name": plan.name, "title": plan.title, "path": str(plan.path)},
            "scripts": scripts,
            "results": [one.to_json() for one in results],
        }
    )


def finite(value: Any) -> Any:
    """Return a value as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(key): finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
