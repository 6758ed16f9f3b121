"""Results of one script as Gradescope's autograder reads them: /autograder/results/results.json.

Format: the section "Output format" of Gradescope's autograder specifications. A test is a criterion; with several
seeds its score is the mean over the flights, and its output names those that failed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading.outputs.by_script import ScriptResults, by_script, describe, flight_label, named_outcomes, points
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import escaped

_TEXT = "text"  # not html: what a script says is shown, never obeyed; without a NUL, which a data base may refuse


def write(plan: Plan, results: Sequence[Result], path: str | Path) -> None:
    """Write the file. Raises ValueError for results of several scripts, OSError in one line that names the file."""
    writing.write(path, json.dumps(content(plan, results), indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result]) -> dict[str, Any]:
    """Return what the file holds. Raises ValueError for results of several scripts, or of none."""
    scripts = by_script(results)
    if len(scripts) != 1:
        raise ValueError(f"Gradescope's results.json is of one script; these results are of {len(scripts)}")
    script = scripts[0]
    names = dict.fromkeys(name for one in script.flights for name, _ in named_outcomes(one))
    return {
        "score": script.points,
        "output": escaped(_overview(plan, script)),
        "output_format": _TEXT,
        "test_output_format": _TEXT,
        "test_name_format": _TEXT,
        "visibility": "visible",
        "tests": [_test(number, name, script) for number, name in enumerate(names, start=1)],
        "extra_data": {"plan": plan.name, "flights": len(script.flights), "passed": script.passed},
    }


def _overview(plan: Plan, script: ScriptResults) -> str:
    lines = [
        f"{plan.title or plan.name}: {script.passed} of {len(script.flights)} flights passed, "
        f"{points(script.points)} of {points(script.of)} points"
    ]
    if len(script.flights) > 1:
        lines.append(f"worst: {flight_label(script.worst)}, {points(script.worst.points)} points")
    lines += [f"{flight_label(one)}: error: {trouble}" for one in script.flights for trouble in one.troubles]
    return "\n".join(lines)


def _test(number: int, name: str, script: ScriptResults) -> dict[str, Any]:
    outcomes = [(one, dict(named_outcomes(one)).get(name)) for one in script.flights]
    there = [outcome for _, outcome in outcomes if outcome is not None]
    return {
        "number": str(number),
        "name": escaped(name),
        "score": sum(one.points for one in there) / len(script.flights),
        "max_score": max(one.of for one in there),
        "status": "passed" if all(one.passed for one in there) else "failed",
        "output": "\n".join(
            escaped(f"{flight_label(result)}: {'passed' if one.passed else 'FAILED'}: {describe(one)}")
            for result, one in outcomes
            if one is not None
        ),
    }
