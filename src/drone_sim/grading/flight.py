"""One flight of a plan, flown and judged in this process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files import writing
from drone_sim.grading.flown import Flown
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result, result_of
from drone_sim.grading.watching import Witness
from drone_sim.offline.recording import Recording
from drone_sim.offline.timeline import first_step
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.control import STOP
from drone_sim.scripting.errors import ScriptError

EXPECTED = (ScriptError, OSError, ValueError, RuntimeError)  # their messages are one line for the user


def grade(
    plan: Plan,
    script: str | None = None,
    seed: int = 0,
    changes: Mapping[str, Any] | None = None,
    table: str | Path | None = None,
) -> Result:
    """Fly once and return how well: the same to the bit for the same plan, script, seed and changes.

    `script` is as in Plan.script_of, `changes` as in Plan.parameters; `table` is a file to write, as `fly --csv` does.
    What goes wrong in the flight is in the result's `error`. Raises OSError for a table that cannot be written.
    """
    changes = changes or {}
    named = plan.script_of(script)
    try:
        parameters = plan.parameters(seed, script, changes)
        simulation = Simulation(parameters, script=named)
    except EXPECTED as error:
        return ungraded(plan, named, seed, changes, _one_line(error))
    witness = Witness(plan, simulation)
    failed = _fly(plan, parameters, simulation, witness)
    flown = witness.flown()
    try:
        simulation.close()
    except EXPECTED as error:  # in cleanup
        failed = failed or _one_line(error)
    if table is not None:
        write(flown.rows, table)
    outcomes = tuple(one.judge(flown) for one in plan.criteria)
    return result_of(plan.name, named, seed, changes, outcomes, flown.end, failed, digest_of(flown.rows))


def ungraded(plan: Plan, script: str, seed: int, changes: Mapping[str, Any], why: str) -> Result:
    """Return the result of a flight that has not been flown, or of which nothing is left; `why` is one line."""
    outcomes = tuple(one.missed("nothing was flown") for one in plan.criteria)
    return result_of(plan.name, script, seed, changes, outcomes, error=why)


def digest_of(rows: np.ndarray) -> str:
    """Return the SHA-256 of a table's numbers, row by row, as little-endian doubles."""
    return hashlib.sha256(np.ascontiguousarray(rows, "<f8").tobytes()).hexdigest()


def write(rows: np.ndarray, path: str | Path) -> None:
    """Write a table (N, 22) as `fly --csv` does. Raises OSError."""
    with writing.replacing(str(path)) as file:
        recording = Recording(file)
        for row in rows.tolist():
            recording.write_row(row)


def _fly(plan: Plan, parameters: Parameters, simulation: Simulation, witness: Witness) -> str | None:
    """Fly to the end; return what went wrong, in one line."""
    error: str | None = None
    try:
        timeline = plan.timeline_of(parameters)
        witness.begin()
        for step in range(first_step(plan.duration, parameters.time_step)):
            timeline.apply(step, simulation.vehicles)
            simulation.step()
            witness.add()
            if simulation.asked == STOP:
                break
    except EXPECTED as failed:
        error = _one_line(failed)
    return error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
