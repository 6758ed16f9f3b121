"""A program that forks a process for each flight (judge_server, script_server): the side that sends it requests."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection, Pipe
from multiprocessing.reduction import send_handle
from typing import Any

from drone_sim.files.resources import python_path
from drone_sim.grading.jobs import sandbox
from drone_sim.grading.jobs.server import HUNG_UP, READY

_START = 60.0  # s for the imports, on a busy machine; they take one
_GRACE = 10.0  # s
_LARGEST = 2**29  # bytes of a reply, or of a table
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
_BROKEN = (EOFError, OSError, ValueError, KeyError, TypeError)  # what a connection raises whose other end is no more


class ServerDied(Exception):
    """The program is no more."""


class ServerProcess:
    """Starts it, and sends and receives; one thread uses this, but `cut` may be called by any."""

    def __init__(self, module: str):
        """Start nothing yet: a `module` beside this one."""
        self._module = module
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self.folder: str | None = None  # for temporary files, where it has one to itself

    def start(self, sandboxed: Callable[[], Sequence[str]] | None = None) -> None:
        """Have it run; `sandboxed` returns what a sandbox puts before a command. Raises ServerDied, and NoSandbox."""
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is not None:
            return
        around, temporary = sandboxed() if sandboxed is not None else (), sandbox.TEMPORARY
        if not around:
            temporary = self.folder = tempfile.mkdtemp(prefix="drone_sim_grading_")
        self._connection, there = Pipe()
        with there:
            self._process = _started(self._module, around, temporary, there)
        if self.receive(_START) != READY:
            raise ServerDied

    def send(self, request: Mapping[str, Any], door: int, *contents: bytes) -> None:
        """Send a request, an end of a connection, and contents of files. Raises ServerDied."""
        with _told():
            connection = self._open()
            connection.send_bytes(json.dumps(request).encode())
            send_handle(connection, door, None)
            for one in contents:
                connection.send_bytes(one)

    def receive(self, patience: float) -> bytes:
        """Return what comes next. Raises ServerDied, also where nothing does within so many s."""
        with _told():
            connection = self._open()
            if not connection.poll(patience):
                raise ServerDied
            return connection.recv_bytes(_LARGEST)

    def end(self, has_hung_up: bool) -> dict[str, Any]:
        """Have the process of the last request ended, which may have hung up; return the reply. Raises ServerDied."""
        with _told():
            self._open().send_bytes(HUNG_UP if has_hung_up else b"")
        reply: dict[str, Any] = json.loads(self.receive(_GRACE))
        return reply

    def _open(self) -> Connection:
        if self._connection is None:
            raise ServerDied
        return self._connection

    def cut(self) -> None:
        """Let everything of it end; called by any thread."""
        if self._connection is not None:
            self._connection.close()

    def close(self) -> None:
        """End it, and whatever it has begun."""
        process, self._process = self._process, None
        if process is None:
            return
        self.cut()
        try:
            process.wait(_GRACE)  # its input has ended
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self.folder is not None:  # however deep it is, and whatever rights it has been left with
            for command in (("chmod", "-R", "u+rwX"), ("rm", "-rf")):
                subprocess.run([*command, "--", self.folder], stderr=subprocess.DEVNULL, check=False)
            self.folder = None


@contextlib.contextmanager
def _told() -> Any:
    try:
        yield
    except _BROKEN as error:
        if getattr(error, "filename", None) is not None:  # a full disk, a program that is not there
            raise
        raise ServerDied from error


def _started(module: str, around: Sequence[str], temporary: str, there: Connection) -> subprocess.Popen[bytes]:
    arguments = ["-m", f"{__package__}.{module}", *(["alone"] if around else [])]
    passed = {name: value for name, value in os.environ.items() if name.startswith(_PASSED)}
    path = python_path(passed.get("PYTHONPATH", ""))
    return subprocess.Popen(
        [*around, sys.executable, *arguments],
        stdin=there.fileno(),
        stdout=subprocess.DEVNULL,
        start_new_session=True,  # the terminal's Ctrl-C is for whoever wants the flights
        env={**passed, **_THE_SAME, "PYTHONPATH": path, "TMPDIR": temporary},
    )
