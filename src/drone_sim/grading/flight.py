"""One flight of a plan, flown and judged in this process."""

from __future__ import annotations

import contextlib
import hashlib
import random
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from drone_sim.command_line import EXPECTED, format_error
from drone_sim.files import writing
from drone_sim.grading.flight_recorder import FlightRecorder, OfflineBackend
from drone_sim.grading.permissions import Permissions
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result, result_of
from drone_sim.grading.rules import Rules, ScriptWatch
from drone_sim.offline.recording import Recording
from drone_sim.offline.timeline import first_step
from drone_sim.run.simulation import Simulation
from drone_sim.scripting import load
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.breakpoints import Breakpoints
from drone_sim.scripting.rpc.connection import ScriptConnection
from drone_sim.scripting.rpc.script_proxy import ScriptProxy
from drone_sim.scripting.time_limit import TimeLimit


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
    try:
        flight = Flight(plan, script, seed, changes)
    except EXPECTED as error:
        return ungraded(plan, script, seed, changes, format_error(error))
    result = flight.grade()
    if table is not None:
        write(flight.rows, table)
    return result


def ungraded(plan: Plan, script: str | None, seed: int, changes: Mapping[str, Any] | None, why: str) -> Result:
    """Return the result of a flight that has not been flown, or of which nothing is left; `why` is one line."""
    outcomes = tuple(one.missed("nothing was flown") for one in plan.criteria)
    return result_of(plan.name, plan.script_of(script), seed, changes or {}, outcomes, error=why)


class Flight:
    """A flight that is ready: all is read and built, and no line of a script has run."""

    def __init__(
        self,
        plan: Plan,
        script: str | None = None,
        seed: int = 0,
        changes: Mapping[str, Any] | None = None,
        connection: ScriptConnection | None = None,
    ):
        """Build it; `plan`, `script`, `seed` and `changes` are as in `grade`. Raises one of EXPECTED.

        With a `connection`, the script runs in another process, and may call what the plan allows; the scene's scripts
        run here.
        """
        self._plan, self._seed, self._changes = plan, seed, changes or {}
        parameters = plan.parameters(seed, "" if script == "" else None, changes)
        self._script = plan.script_of(script) or parameters.script
        self._timeline = plan.timeline_of(parameters)
        self._steps = first_step(plan.duration, parameters.time_step)
        backend = OfflineBackend(plan.topics_of(parameters))
        watch = ScriptWatch()
        self._simulation = Simulation(
            parameters,
            script=self._script,
            backend=backend if backend.wanted else None,
            started=False,
            load_script=_loader(connection, self._script, watch),
        )
        backend.clock, backend.is_scene = lambda: self._simulation.time, lambda: watch.is_scene
        try:
            self._recorder = FlightRecorder(plan, self._simulation, backend)
            self._permissions = Permissions(plan, self._simulation, self._script, self._recorder.goals)
            self._rules = Rules(plan, self._simulation, watch)
            if connection is not None:
                connection.begin(self._simulation.context.objects, self._is_quiet, self._permissions)
        except BaseException:
            self._simulation.close()
            raise

    def grade(self) -> Result:
        """Fly, once, and return how well."""
        with _seeded(self._seed):
            try:
                failed = _failure(self._fly) or self._failed_scripts()
            finally:
                closed = _failure(self._simulation.close)  # cleanup may fail, too
        plan, wrong, record = self._plan, failed or closed, self._recorder.record()
        if record is None:
            nothing = ungraded(plan, self._script, self._seed, self._changes, wrong or "nothing was flown")
            return nothing.with_tried(self._permissions.tried)
        outcomes = tuple(one.judge(record) for one in plan.criteria)
        digest = digest_of(record.rows)
        result = result_of(plan.name, self._script, self._seed, self._changes, outcomes, record.end, wrong, digest)
        return result.with_tried(self._permissions.tried)

    @property
    def rows(self) -> np.ndarray:
        """The table of what has been flown, (N, 22): see offline.recording.COLUMNS."""
        return self._recorder.rows

    def _fly(self) -> None:
        self._simulation.load_scripts()
        self._rules.check()
        self._recorder.record_step()
        for step in range(self._steps):
            self._timeline.apply(step, self._simulation.vehicles)
            self._rules.accept()
            self._simulation.step(self._recorder.look)
            self._rules.check()  # what breaks them is not recorded: nothing is reached by it
            self._recorder.record_step()
            if self._recorder.is_over:
                return

    def _is_quiet(self) -> bool:
        """Tell whether no message or other script can reach the flying script before its actuation of the next step."""
        simulation = self._simulation
        scripts = len(simulation.child_scripts) + len(simulation.scene.scripts)
        return scripts == 1 and simulation.drone.commands.is_quiet and not self._timeline.is_due(simulation.steps)

    def _failed_scripts(self) -> str | None:
        names = self._simulation.failed_scripts
        return f"the scripts of {', '.join(names)} failed: the log says why" if names else None


def digest_of(rows: np.ndarray) -> str:
    """Return the SHA-256 of a table's numbers, row by row, as little-endian doubles."""
    return hashlib.sha256(np.ascontiguousarray(rows, "<f8").tobytes()).hexdigest()


def write(rows: np.ndarray, path: str | Path) -> None:
    """Write a table (N, 22) as `fly --csv` does. Raises OSError."""
    with writing.replacing(str(path)) as file:
        write_to(file, rows)


def write_to(file: IO[str], rows: np.ndarray) -> None:
    """Write a table (N, 22) into an open file. Raises OSError."""
    recording = Recording(file)
    for row in cast("list[list[float]]", rows.tolist()):
        recording.write_row(row)


def random_of(seed: int) -> int:
    """Return the seed of Python's and numpy's own generators in scripts; it does not reveal `seed`."""
    return int.from_bytes(hashlib.sha256(b"what scripts draw, %d" % seed).digest()[:8], "little")


def _loader(connection: ScriptConnection | None, submission: str, watch: ScriptWatch) -> load.Loader:
    """Return a function that loads the submission through a connection, if there is one, and other scripts here."""

    def load_script(
        path: str, modules: Mapping[str, Api], limit: TimeLimit, turns: Turns, breakpoints: Breakpoints | None = None
    ) -> load.Script:
        if path == submission and connection is not None:
            return watch.watched(ScriptProxy(connection, path, modules, limit), False)
        is_scene = path != submission
        loaded = watch.run(is_scene, load.load, path, modules, limit, turns, breakpoints)
        return watch.watched(loaded, is_scene)

    return load_script


def _failure(action: Callable[[], None]) -> str | None:
    """Return what went wrong in an action, in one line; None for nothing."""
    try:
        action()
    except EXPECTED as error:
        return format_error(error)
    return None


@contextlib.contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Let scripts that draw from Python's and numpy's own generators draw the same in every flight of a seed."""
    kept, kept_numpy = random.getstate(), np.random.get_state()
    random.seed(random_of(seed))
    np.random.seed(random_of(seed) % 2**32)
    try:
        yield
    finally:
        random.setstate(kept)
        np.random.set_state(kept_numpy)
