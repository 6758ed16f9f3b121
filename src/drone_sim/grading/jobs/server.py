"""What the two programs share that fork a process for each flight: the judge's and the script's.

Such a program has imported everything. Its standard input is a connection that brings requests in JSON and takes the
replies. The program ends when this connection ends, whatever a flight does, and when there has been no request for a
while.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import signal
import socket
from collections.abc import Iterator
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle
from typing import Any

from drone_sim.grading.jobs.limited_process import guard

HANDED_IN = "/handed_in"  # below which the files of a script are laid in a sandbox, each under its whole path
READY = b"ready"  # said once, after the imports
HUNG_UP = b"hung up"  # said of a script's process at the end of a flight; else nothing is
GONE = (EOFError, ConnectionError)  # raised once nobody wants anything any more, however they ended
_IDLE = 120.0  # s


class Requests:
    """What is asked of the program."""

    def __init__(self) -> None:
        """Move the connection from standard input to another descriptor; standard input is /dev/null then."""
        guard()
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # from the first process of a sandbox the kernel keeps it, then
        self._connection: Connection = Connection(os.dup(0))
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, 0)
        os.close(nothing)

    def __iter__(self) -> Iterator[tuple[dict[str, Any], socket.socket]]:
        """Say that it is ready, and give each request, with one end of the connection between judge and script.

        After the fork this process closes its copy of the end, so that the other end notices when the forked process is
        gone.
        """
        gc.collect()
        gc.freeze()  # a fork that counts references copies fewer pages
        with contextlib.suppress(*GONE):
            self._connection.send_bytes(READY)
            while self._connection.poll(_IDLE):
                request = json.loads(self._connection.recv_bytes())
                with socket.socket(fileno=recv_handle(self._connection)) as door:
                    yield request, door

    def fileno(self) -> int:
        """Return what is readable where there is more to receive, or the input has ended."""
        return self._connection.fileno()

    def receive(self) -> bytes:
        """Return what comes next. Raises EOFError."""
        return self._connection.recv_bytes()

    def reply(self, *parts: bytes) -> None:
        """Answer the last request."""
        for one in parts:
            self._connection.send_bytes(one)
