"""Flights in processes of their own, seen from whoever wants them flown: the other end of `fork_server`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

from drone_sim.files.resources import FileCache, Identity, ReadFile, identity_of, python_path
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import files, sandbox
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.jobs.fork_server import READY
from drone_sim.grading.jobs.job import Job, JobResult, lost
from drone_sim.grading.jobs.sandbox import NoSandbox
from drone_sim.grading.jobs.settings import FlightLimits
from drone_sim.grading.result import Result
from drone_sim.scripting.errors import ScriptError

_START = 60.0  # s for the imports, on a busy machine; they take one
_GRACE = 10.0  # s beyond what a flight may take
_LARGEST = 2**29  # bytes of a reply, or of a table
_MOST_PLANS = 8  # kept in memory
_TRIES = 2  # of a flight whose fork server has died: it may have been somebody else's doing
# What the process knows of its surroundings; passwords and tokens are not for scripts.
_PASSED = (
    "PATH",
    "HOME",
    "LANG",
    "LC_",
    "PYTHON",
    "LD_LIBRARY_PATH",
    "ROS_",
    "XDG_",
    "LIBGL_",
    "GALLIUM_",
    "MESA_",
    "EGL_",
)
# The same order of sets, and of sums, in every process.
_THE_SAME = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class Cancelled(Exception):
    """Nobody wants the flight any more."""


class _Died(Exception):
    """The fork server is no more."""


class ForkServerClient:
    """Flies by a process that has everything imported and forks one for each flight.

    The process starts when it is needed. One thread uses this, and closes it.
    """

    def __init__(self, limits: FlightLimits, sandboxed: bool = True):
        """Start nothing yet. `limits` are of a flight; `sandboxed`: in the sandbox, which then must be there."""
        self._limits = limits
        self._sandboxed = sandboxed
        self._process: subprocess.Popen[bytes] | None = None
        self._requests: Connection | None = None  # to it
        self._replies: Connection | None = None  # from it
        self._folder: str | None = None
        self._plans: FileCache[plans.Plan] = FileCache(self._read_plan, _MOST_PLANS)
        self._files: dict[str, list[Path]] = {}  # of the last plan, with changes
        self._shown: dict[Path, Identity] = {}  # what a sandbox was made to show
        self._is_stopped = False

    def fly(self, job: Job, table: bool = False) -> JobResult:
        """Fly once, whatever the script does. Raises PlanError, Cancelled, and NoSandbox where one is wanted."""
        plan = self._plans.get(job.plan)
        if job.error:
            return lost(job, plan, job.error)
        why = ""
        if self._is_stopped:
            raise Cancelled
        for _ in range(_TRIES):
            try:
                reply, rows = self._ask(plan, job, table)
            except Unreadable as error:
                return lost(job, plan, str(error))
            except _Died:
                self.close()
                if self._is_stopped:
                    raise Cancelled from None
                why = "ended the process that watches its flight"
                continue
            if reply.get("result") is not None:
                result = _as_asked(job, Result.from_json(reply["result"]))
                return JobResult(job, result, rows if result.flown else b"")
            why = reply.get("lost") or "gave no result"
            break
        return lost(job, plan, f"the script {why}")

    def stop(self) -> None:
        """Let `fly` raise Cancelled, now and from now on; called by another thread."""
        self._is_stopped = True
        if self._requests is not None:
            self._requests.close()  # the pipe whose end is the end of everything

    def close(self) -> None:
        """End it, and whatever it flies."""
        process, self._process = self._process, None
        if process is None:
            return
        for connection in filter(None, (self._requests, self._replies)):
            connection.close()
        try:
            process.wait(_GRACE)  # its input has ended
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._folder is not None:  # however deep it is, and whatever rights it has been left with
            for command in (("chmod", "-R", "u+rwX"), ("rm", "-rf")):
                subprocess.run([*command, "--", self._folder], stderr=subprocess.DEVNULL, check=False)
            self._folder = None

    def _read_plan(self, path: str) -> ReadFile:
        self._files.clear()
        plan = plans.read(path)
        return ReadFile(plan, 1, map(str, plan.files))

    def _request(self, job: Job, duration: float, table: bool, handed_in: Mapping[str, bytes]) -> dict[str, Any]:
        own = self._limits
        return {
            "plan": job.plan,
            "script": f"{sandbox.HANDED_IN}{job.script}" if handed_in else job.script,
            "handed_in": list(handed_in),
            "seed": job.seed,
            "changes": dict(job.changes),
            "table": table,
            "seconds": own.processor_time(duration),
            "real_time": own.real_time(duration),
            **own.model_dump(include={"memory", "files", "processes", "open_files"}),
        }

    def _ask(self, plan: plans.Plan, job: Job, table: bool) -> tuple[dict[str, Any], bytes]:
        """Return what a process replies to a request, and the table. Raises _Died, Unreadable and NoSandbox."""
        handed_in = _handed_in(plan, job) if self._sandboxed else {}
        request = self._request(job, plan.duration, table, handed_in)
        try:
            requests, replies = self._running(plan, job)
            for content in (json.dumps(request).encode(), *handed_in.values()):
                requests.send_bytes(content)
            reply = json.loads(_received(replies, request["real_time"] + _GRACE))
            rows = _received(replies, _GRACE)
            if reply["is_last"]:
                self.close()
            return reply, rows
        except NoSandbox:
            raise
        except (EOFError, OSError, ValueError, KeyError, TypeError) as error:
            if getattr(error, "filename", None) is not None:  # a full disk, a program that is not there
                raise
            raise _Died from error

    def _running(self, plan: plans.Plan, job: Job) -> tuple[Connection, Connection]:
        """Return what leads to the process, and from it; start it where it is not there."""
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._sandboxed:
            self._show(plan, job)
        if self._process is None or self._requests is None or self._replies is None:
            around, temporary = [], sandbox.TEMPORARY
            if self._sandboxed:
                around = sandbox.command(self._limits.files, self._shown)
            else:
                temporary = self._folder = tempfile.mkdtemp(prefix="drone_sim_grading_")
            input_there, self._requests = Pipe(duplex=False)
            self._replies, output_there = Pipe(duplex=False)
            with input_there, output_there:
                self._process = _started(around, temporary, input_there, output_there)
            if _received(self._replies, _START) != READY:
                raise _Died
        return self._requests, self._replies

    def _show(self, plan: plans.Plan, job: Job) -> None:
        """End a process that does not see the files of a flight's plan as they are now; the next one will."""
        texts = {key: one for key, one in job.changes.items() if not isinstance(one, (int, float))}
        needed = {path: identity_of(str(path)) for path in self._needed(plan, texts)}
        if not needed.items() <= self._shown.items():
            self.close()
            as_before = {path: one for path, one in self._shown.items() if identity_of(str(path)) == one}
            self._shown = {**as_before, **needed}

    def _needed(self, plan: plans.Plan, changes: Mapping[str, Any]) -> Sequence[Path]:
        known = json.dumps([str(plan.path), changes], sort_keys=True, default=str)
        if known not in self._files:
            self._files.clear()
            self._files[known] = files.of_plan(plan, changes)
        return self._files[known]


def _handed_in(plan: plans.Plan, job: Job) -> dict[str, bytes]:
    """Return the files of a job's script. Raises Unreadable."""
    try:
        return {str(path): files.read(path) for path in files.of_script(plan, job.script)}
    except (OSError, ScriptError) as error:
        raise Unreadable(str(error)) from None


def _as_asked(job: Job, result: Result) -> Result:
    """Return a result that names the script where it lies, not where it was flown."""
    folder = os.path.dirname(job.script)
    error = result.error and result.error.replace(f"{sandbox.HANDED_IN}{folder}", folder)
    return replace(result, script=job.script, error=error)


def _started(around: list[str], temporary: str, stdin: Connection, stdout: Connection) -> subprocess.Popen[bytes]:
    arguments = ["-m", "drone_sim.grading.jobs.fork_server", *(["alone"] if around else [])]
    passed = {name: value for name, value in os.environ.items() if name.startswith(_PASSED)}
    path = python_path(passed.get("PYTHONPATH", ""))
    return subprocess.Popen(
        [*around, sys.executable, *arguments],
        stdin=stdin.fileno(),
        stdout=stdout.fileno(),
        start_new_session=True,  # the terminal's Ctrl-C is for whoever wants the flights
        env={**passed, **_THE_SAME, "PYTHONPATH": path, "TMPDIR": temporary},
    )


def _received(replies: Connection, patience: float) -> bytes:
    """Return what comes next. Raises EOFError where nothing comes any more, OSError where it does not within s."""
    if not replies.poll(patience):
        raise TimeoutError("no reply")
    return replies.recv_bytes(_LARGEST)
