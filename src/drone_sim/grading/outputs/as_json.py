"""Everything, for programs: one JSON object with a version."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading.outputs.by_script import by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

VERSION = 1  # of the format: another one where a key is renamed or means something else, not where one comes


def write(plan: Plan, results: Sequence[Result], path: str | Path) -> None:
    """Write the file. Raises OSError, in one line that names it."""
    writing.write(path, json.dumps(content(plan, results), indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result]) -> dict[str, Any]:
    """Return what the file holds; a figure that is no finite number is null."""
    scripts = [
        {
            "script": one.script,
            "flights": len(one.flights),
            "passed": one.passed,
            "points": one.points,
            "of": one.of,
            "worst": {"seed": one.worst.seed, "points": one.worst.points},
            "failed": dict(one.failures),
        }
        for one in by_script(results)
    ]
    return _finite(
        {
            "format": "drone_sim grades",
            "version": VERSION,
            "plan": {"name": plan.name, "title": plan.title},
            "scripts": scripts,
            "results": [asdict(one) for one in results],
        }
    )


def _finite(value: Any) -> Any:
    """Return a value as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(key): _finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
