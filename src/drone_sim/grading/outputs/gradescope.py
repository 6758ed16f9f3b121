"""Results of one script for Gradescope's autograder: /autograder/results/results.json.

The section "Output format" of Gradescope's autograder specifications defines the format. A criterion becomes a test.
Its score is the mean over the flights, and its output names the failed flights.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading.outputs.script_results import (
    ScriptResults,
    describe,
    flight_label,
    format_points,
    group_by_script,
    named_outcomes,
)
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import escaped

_TEXT = "text"  # not html, so that text of scripts is never interpreted


def write(plan: Plan, results: Sequence[Result], path: str | Path) -> None:
    """Write the file. Raises ValueError for results of several scripts, OSError in one line that names the file."""
    writing.write(path, json.dumps(content(plan, results), indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result]) -> dict[str, Any]:
    """Return the content of the file. Raises ValueError unless there are results of exactly one script."""
    scripts = group_by_script(results)
    if len(scripts) != 1:
        raise ValueError(f"Gradescope's results.json must be of one script, not {len(scripts)}")
    script = scripts[0]
    lines = [
        f"{plan.title or plan.name}: {script.passed} of {len(script.flights)} flights passed, "
        f"{format_points(script.points)} of {format_points(script.of)} points"
    ]
    if len(script.flights) > 1:
        lines.append(f"worst: {flight_label(script.worst)}, {format_points(script.worst.points)} points")
    lines += [f"{flight_label(flight)}: error: {trouble}" for flight in script.flights for trouble in flight.troubles]
    names = dict.fromkeys(name for flight in script.flights for name, _ in named_outcomes(flight))
    return {
        "score": script.points,
        "output": escaped("\n".join(lines)),
        "output_format": _TEXT,
        "test_output_format": _TEXT,
        "test_name_format": _TEXT,
        "visibility": "visible",
        "tests": [_test(number, name, script) for number, name in enumerate(names, start=1)],
        "extra_data": {"plan": plan.name, "flights": len(script.flights), "passed": script.passed},
    }


def _test(number: int, name: str, script: ScriptResults) -> dict[str, Any]:
    outcomes = [(flight, dict(named_outcomes(flight)).get(name)) for flight in script.flights]
    judged = [outcome for _, outcome in outcomes if outcome is not None]
    return {
        "number": str(number),
        "name": escaped(name),
        "score": sum(outcome.points for outcome in judged) / len(script.flights),
        "max_score": max(outcome.of for outcome in judged),
        "status": "passed" if all(outcome.passed for outcome in judged) else "failed",
        "output": "\n".join(
            escaped(f"{flight_label(result)}: {'passed' if outcome.passed else 'FAILED'}: {describe(outcome)}")
            for result, outcome in outcomes
            if outcome is not None
        ),
    }
