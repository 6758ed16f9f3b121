"""The connection of judge_server and script_server, the programs that fork a process for each flight, to their client.

Such a program has imported everything. Its standard input is a connection that carries requests in JSON and replies.
The program ends when this connection ends, whatever a flight does, and when there has been no request for a while.
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

from drone_sim.grading.jobs.limited_process import adopt_orphans, hide_memory

HANDED_IN = "/handed_in"  # folder in the sandbox with a script's files, each under its whole path
READY = b"ready"  # sent once, after the imports
HUNG_UP = b"hung up"  # sent to script_server after a flight if the script's process has closed its connection
DISCONNECTED = (EOFError, ConnectionError)  # errors of a connection that the client has closed
_IDLE = 120.0  # s


class Requests:
    def __init__(self) -> None:
        """Move the connection from standard input, which becomes /dev/null, to another descriptor."""
        hide_memory()
        adopt_orphans()
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # the kernel does not deliver it to the first process of a sandbox
        self._connection: Connection = Connection(os.dup(0))
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, 0)
        os.close(null)

    def __iter__(self) -> Iterator[tuple[dict[str, Any], socket.socket]]:
        """Send READY, and yield each request with one end of the connection between judge and script.

        This process closes its copy of that end after the fork, so that the other end notices when the forked process
        ends.
        """
        gc.collect()
        gc.freeze()  # so that forks copy fewer pages when they count references
        with contextlib.suppress(*DISCONNECTED):
            self._connection.send_bytes(READY)
            while self._connection.poll(_IDLE):
                request = json.loads(self._connection.recv_bytes())
                with socket.socket(fileno=recv_handle(self._connection)) as link:
                    yield request, link

    def fileno(self) -> int:
        """Return a descriptor that is readable if there is a message, or if the connection has ended."""
        return self._connection.fileno()

    def receive(self) -> bytes:
        """Return the next message. Raises EOFError."""
        return self._connection.recv_bytes()

    def reply(self, *parts: bytes) -> None:
        for part in parts:
            self._connection.send_bytes(part)
