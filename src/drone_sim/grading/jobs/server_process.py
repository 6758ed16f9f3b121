"""The client side of a server that forks a process for each flight: judge_server or script_server."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection, Pipe
from multiprocessing.reduction import send_handle
from typing import Any

from drone_sim.files.resources import python_path
from drone_sim.grading.jobs import sandbox
from drone_sim.grading.jobs.server import HUNG_UP, READY

_START_TIMEOUT = 60.0  # s for the imports on a busy machine; usually they take 1 s
_GRACE = 10.0  # s
_MAX_MESSAGE = 2**29  # bytes
# Prefixes of the environment variables that a server inherits: passwords and tokens are not for scripts.
_INHERITED_VARIABLES = (
    *("PATH", "HOME", "LANG", "LC_", "PYTHON", "LD_LIBRARY_PATH", "ROS_", "XDG_"),
    *("LIBGL_", "GALLIUM_", "MESA_", "EGL_"),
)
# Make the order of sets, and of sums, the same in every process.
_DETERMINISTIC = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_CONNECTION_ERRORS = (EOFError, OSError, ValueError, KeyError, TypeError)  # of a connection to an ended process


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
