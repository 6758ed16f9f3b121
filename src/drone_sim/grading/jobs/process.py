"""Flights in processes of their own, seen from whoever wants them flown."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drone_sim.files.resources import python_path
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import ungraded
from drone_sim.grading.jobs import files, sandbox
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.jobs.job import Job
from drone_sim.grading.jobs.sandbox import NoSandbox
from drone_sim.grading.jobs.settings import Limits
from drone_sim.grading.jobs.warm import READY
from drone_sim.grading.result import Result
from drone_sim.scripting.errors import ScriptError

_START = 60.0  # s for the imports, on a busy machine; they take one
_GRACE = 10.0  # s beyond what a flight may take
_LONGEST = 2**23  # bytes of a reply's line
_TRIES = 2  # of a flight whose warm process has died: it may have been somebody else's doing
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


_Version = tuple[int, ...]


@dataclass(frozen=True)
class Flight:
    """A job that was flown: its result, and its table as `fly --csv` writes it, b'' where there is none."""

    job: Job
    result: Result
    table: bytes = b""
    is_lost: bool = False  # a limit or a crash ended it: another time it may end in another way


class Stopped(Exception):
    """Nobody wants the flight any more."""


class _Died(Exception):
    """The warm process is no more."""


class Warm:
    """A process that has everything imported and forks one for each flight.

    It starts when it is needed. One thread uses it, and closes it.
    """

    def __init__(self, limits: Limits, sandboxed: bool = True):
        """Take what a flight may take, and whether it is flown in the sandbox, which then must be there."""
        self._limits = limits
        self._sandboxed = sandboxed
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: str | None = None
        self._plans: dict[str, tuple[plans.Plan, list[_Version]]] = {}
        self._files: dict[str, list[Path]] = {}  # of the last plan, with changes
        self._shown: dict[Path, _Version] = {}  # what a sandbox was made to show
        self._is_stopped = False

    def fly(self, job: Job, table: bool = False) -> Flight:
        """Fly once, whatever the script does. Raises PlanError, Stopped, and NoSandbox where one is wanted."""
        plan = self._plan(job.plan)
        if job.error:
            return _lost(job, plan, job.error)
        why = ""
        if self._is_stopped:
            raise Stopped
        for _ in range(_TRIES):
            try:
                reply, rows = self._ask(plan, job, table)
            except Unreadable as error:
                return _lost(job, plan, str(error))
            except _Died:
                self.close()
                if self._is_stopped:
                    raise Stopped from None
                why = "ended the process that watches its flight"
                continue
            if reply.get("result") is not None:
                result = _as_asked(job, Result.from_json(reply["result"]))
                return Flight(job, result, rows if result.flown else b"")
            why = reply.get("lost") or "gave no result"
            break
        return _lost(job, plan, f"the script {why}")

    def stop(self) -> None:
        """Let `fly` raise Stopped, now and from now on; called by another thread."""
        self._is_stopped = True
        process = self._process
        if process is not None and process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.close()  # the pipe whose end is the end of everything

    def close(self) -> None:
        """End it, and whatever it flies."""
        process, self._process = self._process, None
        if process is None:
            return
        for stream in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                stream.close()  # type: ignore[union-attr]
        try:
            process.wait(_GRACE)  # its input has ended
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._folder is not None:
            _remove(self._folder)
            self._folder = None

    def _plan(self, path: str) -> plans.Plan:
        """Return a plan, read anew where one of its files is another."""
        known = self._plans.get(path)
        if known is None or known[1] != [_version(one) for one in known[0].files]:
            plan = plans.read(path)
            self._plans[path] = plan, [_version(one) for one in plan.files]
            self._files.clear()
        return self._plans[path][0]

    def _request(self, job: Job, duration: float, table: bool, handed_in: Mapping[str, bytes]) -> dict[str, Any]:
        own = self._limits
        return {
            "plan": job.plan,
            "script": f"{sandbox.HANDED_IN}{job.script}" if handed_in else job.script,
            "handed_in": {path: len(content) for path, content in handed_in.items()},
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
            process = self._running(plan, job)
            assert process.stdin is not None and process.stdout is not None
            until = time.monotonic() + request["real_time"] + _GRACE
            process.stdin.write(b"".join((json.dumps(request).encode(), b"\n", *handed_in.values())))
            process.stdin.flush()
            line, rest = _line(process.stdout.fileno(), until)
            reply = json.loads(line)
            rows = rest + _bytes(process.stdout.fileno(), reply["table"] - len(rest), until)
            if reply["is_last"]:
                self.close()
            return reply, rows
        except NoSandbox:
            raise
        except (OSError, ValueError, KeyError, TypeError) as error:
            if getattr(error, "filename", None) is not None:  # a full disk, a program that is not there
                raise
            raise _Died from error

    def _running(self, plan: plans.Plan, job: Job) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._sandboxed:
            self._show(plan, job)
        if self._process is None:
            around, temporary = [], sandbox.TEMPORARY
            if self._sandboxed:
                around = sandbox.command(self._limits.files, self._shown)
            else:
                temporary = self._folder = tempfile.mkdtemp(prefix="drone_sim_grading_")
            self._process = _started(around, temporary)
            assert self._process.stdout is not None
            if _line(self._process.stdout.fileno(), time.monotonic() + _START) != (READY, b""):
                raise _Died
        return self._process

    def _show(self, plan: plans.Plan, job: Job) -> None:
        """End a process that does not see the files of a flight's plan as they are now; the next one will."""
        texts = {key: one for key, one in job.changes.items() if not isinstance(one, (int, float))}
        needed = {path: _version(path) for path in self._needed(plan, texts)}
        if not needed.items() <= self._shown.items():
            self.close()
            self._shown = {path: one for path, one in self._shown.items() if _version(path) == one} | needed

    def _needed(self, plan: plans.Plan, changes: Mapping[str, Any]) -> Sequence[Path]:
        known = json.dumps([str(plan.path), changes], sort_keys=True, default=str)
        if known not in self._files:
            self._files.clear()
            self._files[known] = files.of_plan(plan, changes)
        return self._files[known]


def _version(path: Path) -> _Version:
    """Return what is another one where a file is replaced, which a sandbox would not see, or is written anew."""
    try:
        status = path.stat()
    except OSError:
        return ()
    return status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size


def _handed_in(plan: plans.Plan, job: Job) -> dict[str, bytes]:
    """Return the files of a job's script. Raises Unreadable."""
    try:
        return {str(path): files.read(path) for path in files.of_script(plan, job.script)}
    except (OSError, ScriptError) as error:
        raise Unreadable(str(error)) from None


def _lost(job: Job, plan: plans.Plan, why: str) -> Flight:
    return Flight(job, ungraded(plan, job.script, job.seed, job.changes, why), is_lost=True)


def _as_asked(job: Job, result: Result) -> Result:
    """Return a result that names the script where it lies, not where it was flown."""
    folder = os.path.dirname(job.script)
    error = result.error and result.error.replace(f"{sandbox.HANDED_IN}{folder}", folder)
    return replace(result, script=job.script, error=error)


_starting = threading.Lock()  # or one process inherits the pipes of another


def _started(around: list[str], temporary: str) -> subprocess.Popen[bytes]:
    arguments = ["-m", "drone_sim.grading.jobs.warm", *(["alone"] if around else [])]
    passed = {name: value for name, value in os.environ.items() if name.startswith(_PASSED)}
    path = python_path(passed.get("PYTHONPATH", ""))
    with _starting:
        return subprocess.Popen(
            [*around, sys.executable, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # the terminal's Ctrl-C is for whoever wants the flights
            env={**passed, **_THE_SAME, "PYTHONPATH": path, "TMPDIR": temporary},
        )


def _remove(folder: str) -> None:
    """Remove a folder, however deep it is and whatever rights it has been left with."""
    for command in (("chmod", "-R", "u+rwX"), ("rm", "-rf")):
        subprocess.run([*command, "--", folder], stderr=subprocess.DEVNULL, check=False)


def _line(descriptor: int, until: float) -> tuple[bytes, bytes]:
    """Return the first line that comes, and what came behind it. Raises OSError."""
    got = bytearray()
    while b"\n" not in got:
        got += _some(descriptor, until)
        if len(got) > _LONGEST:
            raise OSError("too long a reply")
    end = got.index(b"\n") + 1
    return bytes(got[:end]), bytes(got[end:])


def _bytes(descriptor: int, number: int, until: float) -> bytes:
    got = bytearray()
    while len(got) < number:
        got += _some(descriptor, until)
    return bytes(got)


def _some(descriptor: int, until: float) -> bytes:
    """Return what comes next. Raises OSError where nothing comes any more, or not in time."""
    if not select.select([descriptor], [], [], max(0.0, until - time.monotonic()))[0]:
        raise TimeoutError("no reply")
    block = os.read(descriptor, 2**18)
    if not block:
        raise OSError("no reply")
    return block
