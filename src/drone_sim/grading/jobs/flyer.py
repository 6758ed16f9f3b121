"""The client of the judge's and the script's server, which run each flight in two processes."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, Pipe
from multiprocessing.reduction import send_handle
from typing import Any

from drone_sim.files.resources import FileCache, ReadFile, python_path
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import script_seed
from drone_sim.grading.jobs import files, sandbox
from drone_sim.grading.jobs.files import Unreadable
from drone_sim.grading.jobs.job import Job, JobResult, lost_flight
from drone_sim.grading.jobs.limited_process import hide_memory
from drone_sim.grading.jobs.server import HANDED_IN, HUNG_UP, READY
from drone_sim.grading.jobs.settings import FlightLimits
from drone_sim.grading.result import Result
from drone_sim.scripting.errors import ScriptError

_GRACE = 10.0  # s beyond the limit of a flight's duration, and for an answer that needs no flight
_SCRIPT_GRACE = 5.0  # s by which the script's limit is longer than the judge's, so that the judge reports first
_MAX_PLANS = 8  # in the cache
_ATTEMPTS = 2  # to fly if a server dies, which may have another cause than the flight
_START_TIMEOUT = 60.0  # s for the imports on a busy machine; usually they take 1 s
_MAX_MESSAGE = 2**29  # bytes
# Prefixes of the environment variables that a server inherits: passwords and tokens are not for scripts.
_INHERITED_VARIABLES = (
    *("PATH", "HOME", "LANG", "LC_", "PYTHON", "LD_LIBRARY_PATH", "ROS_", "XDG_"),
    *("LIBGL_", "GALLIUM_", "MESA_", "EGL_"),
)
# Make the order of sets, and of sums, the same in every process.
_DETERMINISTIC = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_CONNECTION_ERRORS = (EOFError, OSError, ValueError, KeyError, TypeError)  # of a connection to an ended process


class Cancelled(Exception):
    """`Flyer.stop` has cancelled the flight."""


class Flyer:
    """Flies jobs with two servers, which have imported everything and fork a process for each flight.

    The servers start with the first flight. All methods but `stop` belong to one thread.
    """

    def __init__(self, limits: FlightLimits, sandboxed: bool = True):
        """Set the `limits` of a flight, and whether scripts run in the sandbox, which must be available then."""
        self._limits = limits
        self._sandboxed = sandboxed
        if not sandboxed:  # scripts can find this process
            hide_memory()
        self._judge = ServerProcess("judge_server")
        self._scripts = ServerProcess("script_server")
        self._plans: FileCache[plans.Plan] = FileCache(_read_plan, _MAX_PLANS)
        self._is_stopped = False

    def fly(self, job: Job, table: bool = False) -> JobResult:
        """Fly once, whatever the script does. Raises PlanError, Cancelled, and NoSandbox."""
        plan = self._plans.get(job.plan)
        if job.error:
            return lost_flight(job, plan, job.error)
        if self._is_stopped:
            raise Cancelled
        reason = ""
        for _ in range(_ATTEMPTS):
            try:
                reply, rows, end = self._request(plan, job, table)
            except Unreadable as error:
                return lost_flight(job, plan, str(error))
            except ServerDied:
                self.close()
                if self._is_stopped:
                    raise Cancelled from None
                reason = "ended the process that watches its flight"
                continue
            if reply.get("result") is not None and not reply["is_gone"]:
                result = Result.from_json(reply["result"])
                folder = os.path.dirname(job.script)
                line = result.error and result.error.replace(f"{HANDED_IN}{folder}", folder)
                result = replace(result, script=job.script, error=line)
                return JobResult(job, result, rows if result.flown else b"")
            reason = end or reply.get("lost") or "ended its process before the flight was over"
            break
        return lost_flight(job, plan, f"the script {reason}")

    def stop(self) -> None:
        """Make `fly` raise Cancelled from now on. Other threads may call this."""
        self._is_stopped = True
        self._judge.disconnect()
        self._scripts.disconnect()

    def close(self) -> None:
        self._judge.close()
        self._scripts.close()

    @property
    def folder(self) -> str | None:
        """The folder for temporary files of scripts without a sandbox, or None."""
        return self._scripts.folder

    def _request(self, plan: plans.Plan, job: Job, table: bool) -> tuple[dict[str, Any], bytes, str]:
        """Return the judge's reply, the table, and how the script's process ended by itself, or ''.

        Raises ServerDied, Unreadable and NoSandbox.
        """
        handed_in: dict[str, bytes] = {}  # contents of the script's files
        if self._sandboxed:
            sandbox.check_hidden(job.plan)
            sandbox.check_hidden(job.script)
            try:
                handed_in = {str(path): files.read(path) for path in files.of_script(plan, job.script)}
            except (OSError, ScriptError) as error:
                raise Unreadable(str(error)) from None
        limits = self._limits.of_flight(plan.duration)
        script_request = {
            "script": f"{HANDED_IN}{job.script}" if handed_in else job.script,
            "handed_in": list(handed_in),
            "random": script_seed(job.seed),
            "limits": {**limits, "real_time": limits["real_time"] + _SCRIPT_GRACE},
        }
        flight = {"plan": job.plan, "script": job.script, "seed": job.seed, "changes": dict(job.changes)}
        judge_request = {**flight, "table": table, "limits": {**limits, "processes": None}}
        self._judge.start()
        self._scripts.start((lambda: sandbox.command(self._limits.files)) if self._sandboxed else None)
        ends = socket.socketpair()
        try:
            self._scripts.send(script_request, ends[0].fileno(), *handed_in.values())
            self._judge.send(judge_request, ends[1].fileno())
        finally:
            for end in ends:
                end.close()
        reply = json.loads(self._judge.receive(limits["real_time"] + _GRACE))
        rows = self._judge.receive(_GRACE)
        ending = self._scripts.end_flight(reply.get("is_gone", False))
        if ending["is_last"]:
            self._scripts.close()
        return reply, rows, ending["end"]


def _read_plan(path: str) -> ReadFile:
    plan = plans.read(path)
    return ReadFile(plan, 1, map(str, plan.files))


class ServerDied(Exception):
    """The server has ended."""


class ServerProcess:
    """A server and the connection to it. All methods but `disconnect` belong to one thread."""

    def __init__(self, module: str):
        """Set the module of this package to run; `start` starts the process."""
        self._module = module
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self.folder: str | None = None  # for temporary files of a server without a sandbox

    def start(self, get_sandbox: Callable[[], Sequence[str]] | None = None) -> None:
        """Start the server if it does not run; `get_sandbox` returns the arguments that run a command in the sandbox.

        Raises ServerDied and NoSandbox.
        """
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is not None:
            return
        prefix, temporary = get_sandbox() if get_sandbox is not None else (), sandbox.TEMPORARY
        if not prefix:
            temporary = self.folder = tempfile.mkdtemp(prefix="drone_sim_grading_")
        inherited = {name: value for name, value in os.environ.items() if name.startswith(_INHERITED_VARIABLES)}
        path = python_path(inherited.get("PYTHONPATH", ""))
        self._connection, server_end = Pipe()
        with server_end:
            self._process = subprocess.Popen(
                [*prefix, sys.executable, "-m", f"{__package__}.{self._module}", *(["alone"] if prefix else [])],
                stdin=server_end.fileno(),
                stdout=subprocess.DEVNULL,
                start_new_session=True,  # the terminal's Ctrl-C is for this process only
                env={**inherited, **_DETERMINISTIC, "PYTHONPATH": path, "TMPDIR": temporary},
            )
        if self.receive(_START_TIMEOUT) != READY:
            raise ServerDied

    def send(self, request: Mapping[str, Any], link: int, *contents: bytes) -> None:
        """Send a request, the descriptor `link`, and contents of files. Raises ServerDied."""
        with _connection_errors():
            connection = self._open()
            connection.send_bytes(json.dumps(request).encode())
            send_handle(connection, link, None)
            for content in contents:
                connection.send_bytes(content)

    def receive(self, timeout: float) -> bytes:
        """Return the next message. Raises ServerDied, also if there is none within `timeout` seconds."""
        with _connection_errors():
            connection = self._open()
            if not connection.poll(timeout):
                raise ServerDied
            return connection.recv_bytes(_MAX_MESSAGE)

    def end_flight(self, has_hung_up: bool) -> dict[str, Any]:
        """Make script_server end the process of the last request, and return the reply. Raises ServerDied."""
        with _connection_errors():
            self._open().send_bytes(HUNG_UP if has_hung_up else b"")
        reply: dict[str, Any] = json.loads(self.receive(_GRACE))
        return reply

    def _open(self) -> Connection:
        if self._connection is None:
            raise ServerDied
        return self._connection

    def disconnect(self) -> None:
        """Close the connection, which ends the server and its flight. Any thread may call this."""
        if self._connection is not None:
            self._connection.close()

    def close(self) -> None:
        """End the server and its flight, and remove its temporary files."""
        process, self._process = self._process, None
        if process is None:
            return
        self.disconnect()
        try:
            process.wait(_GRACE)  # it ends because its input has ended
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self.folder is not None:  # scripts may have left deep folders, or folders without permissions
            for command in (("chmod", "-R", "u+rwX"), ("rm", "-rf")):
                subprocess.run([*command, "--", self.folder], stderr=subprocess.DEVNULL, check=False)
            self.folder = None


@contextlib.contextmanager
def _connection_errors() -> Iterator[None]:
    """Raise ServerDied for an error of the connection."""
    try:
        yield
    except _CONNECTION_ERRORS as error:
        if getattr(error, "filename", None) is not None:  # of another file, such as a full disk
            raise
        raise ServerDied from error
