"""One flight of a plan, flown and judged in this process."""

from __future__ import annotations

import contextlib
import hashlib
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from drone_sim.command_line import EXPECTED, format_error
from drone_sim.config.types import ParameterError
from drone_sim.files import writing
from drone_sim.grading.flight_record import FlightRecord
from drone_sim.grading.flight_recorder import FlightRecorder, OfflineBackend
from drone_sim.grading.permissions import Permissions
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.grading.rules import Rules, ScriptWatch
from drone_sim.offline.recording import Recording
from drone_sim.offline.timeline import first_step
from drone_sim.run.simulation import Simulation
from drone_sim.run.simulation_setup import own_script
from drone_sim.scripting import load
from drone_sim.scripting.api.calls import Api
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
    """Fly once and return the result, which is the same to the bit for the same plan, script, seed and changes.

    `script` is as in Plan.script_of, `changes` as in Plan.parameters; `table` is the name of a file to write, in the
    format of `fly --csv`. An error of the flight is in the result's `error`. Raises OSError if the table cannot be
    written.
    """
    try:
        flight = Flight(plan, script, seed, changes)
    except EXPECTED as error:
        return result_of(plan, script, seed, changes, format_error(error))
    result = flight.grade()
    if table is not None:
        with writing.replacing(str(table)) as file:
            write_table(flight.rows, file)
    return result


def result_of(
    plan: Plan,
    script: str | None,
    seed: int,
    changes: Mapping[str, Any] | None,
    error: str | None,
    record: FlightRecord | None = None,
    tried: Sequence[str] = (),
) -> Result:
    """Return the result of a flight; without a `record`, of one that was not flown, or of which no row is left.

    It has passed if every criterion has, there was no `error` (one line), and nothing forbidden was `tried`.
    """
    if record is None:
        outcomes = tuple(criterion.fail("nothing was flown") for criterion in plan.criteria)
        flown, digest, error = 0.0, "", "nothing was flown" if error is None else error
    else:
        outcomes = tuple(criterion.judge(record) for criterion in plan.criteria)
        flown, digest = record.end, table_digest(record.rows)
    return Result(
        plan=plan.name,
        script=plan.script_of(script),
        seed=seed,
        changes=dict(changes or {}),
        passed=error is None and not tried and all(outcome.passed for outcome in outcomes),
        points=sum(outcome.points for outcome in outcomes),
        of=sum(outcome.of for outcome in outcomes),
        flown=flown,
        error=error,
        outcomes=outcomes,
        digest=digest,
        tried=tuple(tried),
    )


class Flight:
    """A flight whose simulation is built, and whose scripts are not loaded yet."""

    def __init__(
        self,
        plan: Plan,
        script: str | None = None,
        seed: int = 0,
        changes: Mapping[str, Any] | None = None,
        connection: ScriptConnection | None = None,
    ):
        """Build the simulation; `plan`, `script`, `seed` and `changes` are as in `grade`. Raises one of EXPECTED.

        With a `connection`, the script runs in another process and may call only what the plan allows; the scene's
        scripts run in this process.
        """
        self._plan, self._seed, self._changes = plan, seed, changes or {}
        parameters = plan.parameters(seed, {**self._changes, "script": ""} if script == "" else self._changes)
        self._script = plan.script_of(script) or parameters.script
        own = {vehicle.name: own_script(vehicle, parameters) for vehicle in parameters.fleet}
        if self._script and own and all(own.values()):
            named = ", ".join(f"vehicles/{name}/script: {path}" for name, path in own.items())
            reason = f"the scene names {named}; remove one of these keys"
            raise ParameterError(f"no vehicle would fly {self._script}: {reason}")
        self._timeline = plan.timeline_of(parameters)
        self._steps = first_step(plan.duration, parameters.time_step)
        backend = OfflineBackend(plan.topics_of(parameters))
        self._watch, self._connection = ScriptWatch(), connection
        self._simulation = Simulation(
            parameters,
            script=self._script,
            backend=backend if backend.topics else None,
            started=False,
            load_script=self._load_script,
        )
        backend.clock, backend.is_scene = lambda: self._simulation.time, lambda: self._watch.is_scene
        try:
            self._recorder = FlightRecorder(plan, self._simulation, backend)
            self._permissions = Permissions(plan, self._simulation, self._script, self._recorder.goals)
            self._rules = Rules(plan, self._simulation, self._watch)
            if connection is not None:
                connection.begin(self._simulation.context.objects, self._permissions)
        except BaseException:
            self._simulation.close()
            raise

    def _load_script(self, path: str, modules: Mapping[str, Api], limit: TimeLimit, *others: Any) -> load.Script:
        """Load the submission through the connection, if there is one, and other scripts in this process."""
        is_scene = path != self._script
        if not is_scene and self._connection is not None:
            return self._watch.wrap(ScriptProxy(self._connection, path, modules, limit), is_scene)
        loaded = self._watch.run(is_scene, load.load, path, modules, limit, *others)
        return self._watch.wrap(loaded, is_scene)

    def grade(self) -> Result:
        """Fly, and return the result. Call this once."""
        with _seeded_generators(self._seed):
            try:
                error = _error_of(self._fly)
                if error is None and (names := self._simulation.failed_scripts):
                    error = f"the scripts of {', '.join(names)} failed: the log says why"
            finally:
                cleanup_error = _error_of(self._simulation.close)  # which runs the scripts' cleanup
        error, record = error or cleanup_error, self._recorder.record()
        return result_of(self._plan, self._script, self._seed, self._changes, error, record, self._permissions.tried)

    @property
    def rows(self) -> np.ndarray:
        """The flown table, (N, 22): see offline.recording.COLUMNS."""
        return self._recorder.rows

    def _fly(self) -> None:
        self._simulation.load_scripts()
        self._rules.check()
        self._recorder.record_step()
        for step in range(self._steps):
            self._timeline.apply(step, self._simulation.vehicles)
            self._rules.accept()
            self._simulation.step(self._recorder.after_sub_step)
            self._rules.check()  # before the step is recorded, so that no criterion passes by a broken rule
            self._recorder.record_step()
            if self._recorder.is_over:
                return


def table_digest(rows: np.ndarray) -> str:
    """Return the SHA-256 of a table's numbers, row by row, as little-endian doubles."""
    return hashlib.sha256(np.ascontiguousarray(rows, "<f8").tobytes()).hexdigest()


def write_table(rows: np.ndarray, file: IO[str]) -> None:
    """Write a table (N, 22) in the format of `fly --csv`. Raises OSError."""
    recording = Recording(file)
    for row in cast("list[list[float]]", rows.tolist()):
        recording.write_row(row)


def script_seed(seed: int) -> int:
    """Return the seed of Python's and NumPy's global generators in scripts, which does not reveal `seed`."""
    return int.from_bytes(hashlib.sha256(b"what scripts draw, %d" % seed).digest()[:8], "little")


def _error_of(action: Callable[[], None]) -> str | None:
    """Run an action, and return its error in one line, or None."""
    try:
        action()
    except EXPECTED as error:
        return format_error(error) or type(error).__name__
    return None


@contextlib.contextmanager
def _seeded_generators(seed: int) -> Iterator[None]:
    """Seed Python's and NumPy's global generators, so that scripts draw the same numbers in every flight of a seed."""
    python_state, numpy_state = random.getstate(), np.random.get_state()
    random.seed(script_seed(seed))
    np.random.seed(script_seed(seed) % 2**32)
    try:
        yield
    finally:
        random.setstate(python_state)
        np.random.set_state(numpy_state)
