"""One flight of a plan, flown and judged in this process."""

from __future__ import annotations

import contextlib
import hashlib
import random
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files import writing
from drone_sim.grading.flown import Flown
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result, result_of
from drone_sim.grading.topics import Topics
from drone_sim.grading.watching import Witness
from drone_sim.offline.recording import Recording
from drone_sim.offline.timeline import Timeline, first_step
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
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
    with _seeded(seed):
        try:
            flown, failed = _flown(plan, plan.parameters(seed, None, changes), named)
        except EXPECTED as error:
            return ungraded(plan, named, seed, changes, _one_line(error))
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


def _flown(plan: Plan, parameters: Parameters, script: str) -> tuple[Flown, str | None]:
    """Fly; return what there is to judge, and what went wrong, in one line. Raises what comes before the first step."""
    topics = Topics(plan.topics_of(parameters))
    timeline = plan.timeline_of(parameters)
    simulation = Simulation(parameters, script=script, backend=topics if topics.wanted else None)
    topics.clock = lambda: simulation.time
    try:
        witness = Witness(plan, simulation, topics)
        witness.keep()
        steps = first_step(plan.duration, parameters.time_step)
        failed = _failure(lambda: _fly(simulation, timeline, steps, witness))
        failed = failed or _failed_scripts(simulation)
        flown = witness.flown()
    finally:
        closed = _failure(simulation.close)  # cleanup may fail, too
    return flown, failed or closed


def _fly(simulation: Simulation, timeline: Timeline, steps: int, witness: Witness) -> None:
    for step in range(steps):
        timeline.apply(step, simulation.vehicles)
        simulation.step()
        witness.keep()
        if witness.is_over:
            return


def _failure(action: Callable[[], None]) -> str | None:
    """Return what went wrong in an action, in one line; None for nothing."""
    try:
        action()
    except EXPECTED as error:
        return _one_line(error)
    return None


def _failed_scripts(simulation: Simulation) -> str | None:
    names = simulation.failed_scripts
    return f"the scripts of {', '.join(names)} failed: the log says why" if names else None


@contextlib.contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Let scripts that draw from Python's and numpy's own generators draw the same in every flight of a seed."""
    kept, kept_numpy = random.getstate(), np.random.get_state()
    random.seed(seed)
    np.random.seed(seed % 2**32)
    try:
        yield
    finally:
        random.setstate(kept)
        np.random.set_state(kept_numpy)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
