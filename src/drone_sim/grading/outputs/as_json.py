"""All results as one JSON object, for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading import evidence
from drone_sim.grading.outputs.script_results import group_by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

FORMAT = "drone_sim grades"
VERSION = 1  # of the format; it changes if a key is renamed or changes its meaning, not if a key is added


def write(
    plan: Plan,
    results: Sequence[Result],
    path: str | Path,
    key: bytes | None = None,
    names: Mapping[str, str] | None = None,
) -> None:
    """Write the file, with a signature if there is a key. Raises OSError, in one line that names the file."""
    values = content(plan, results, names)
    values = values if key is None else evidence.sign(values, key)
    writing.write(path, json.dumps(values, indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result], names: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the content of the file; figures that are not finite become None."""
    scripts = [
        {
            "script": script.script,
            "name": script.label,
            "flights": len(script.flights),
            "passed": script.passed,
            "points": script.points,
            "of": script.of,
            "worst": {"seed": script.worst.seed, "points": script.worst.points},
            "failed": dict(script.failures),
            "hashes": evidence.hashes_of(plan, script.script),
        }
        for script in group_by_script(results, names)
    ]
    return finite(
        {
            "format": FORMAT,
            "version": VERSION,
            "plan": {"name": plan.name, "title": plan.title, "path": str(plan.path)},
            "scripts": scripts,
            "results": [result.to_json() for result in results],
        }
    )


def finite(value: Any) -> Any:
    """Return a value with None for each number that is not finite, which JSON does not allow."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
