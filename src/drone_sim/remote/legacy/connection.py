"""A client's socket: received packets, and replies not sent completely yet."""

from __future__ import annotations

import socket

from drone_sim.remote.legacy.wire import Packets

_READ_SIZE = 256 * 1024  # bytes
_KEEP_ALIVE = (  # detects a lost machine: s of silence, s between probes, probes, ms for unacknowledged data
    (socket.TCP_KEEPIDLE, 2),
    (socket.TCP_KEEPINTVL, 2),
    (socket.TCP_KEEPCNT, 3),
    (socket.TCP_USER_TIMEOUT, 30_000),
)


class Connection:
    """A client's socket; while a reply has not been sent completely, no further requests are read."""

    def __init__(self, peer: socket.socket, name: str):
        """Use the connected socket `peer`; `name` is for the log."""
        self.name = name
        self.ended = False  # whether the client has closed it
        self._peer = peer
        self._packets = Packets()
        self._out = memoryview(b"")
        peer.setblocking(False)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in _KEEP_ALIVE:
            peer.setsockopt(socket.IPPROTO_TCP, option, value)

    def fileno(self) -> int:
        """Return the socket's file descriptor."""
        return self._peer.fileno()

    @property
    def port(self) -> int:
        """The server's port that the client has connected to."""
        return int(self._peer.getsockname()[1])

    @property
    def has_to_write(self) -> bool:
        """Whether a reply has not been sent completely."""
        return len(self._out) > 0

    def receive(self) -> None:
        """Read available data."""
        try:
            received = self._peer.recv(_READ_SIZE)
            # A client sends each packet when the last one is acknowledged: acknowledge at once, not after 40 ms.
            self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        except BlockingIOError:
            return
        except OSError:
            received = b""
        self.ended = not received
        self._packets.add(received)

    def take(self) -> bytes | None:
        """Return the next message, None if it is incomplete. Raises ValueError for an invalid message."""
        return self._packets.take()

    def send(self, message: bytes) -> None:
        """Send a reply, as far as the socket accepts it."""
        self._out = memoryview(self._packets.of(message))
        self.flush()

    def flush(self) -> None:
        """Send the rest of the reply, as far as the socket accepts it."""
        try:
            while self._out:
                self._out = self._out[self._peer.send(self._out) :]
        except BlockingIOError:
            return
        except OSError:
            self.ended, self._out = True, memoryview(b"")

    def close(self) -> None:
        """Close the socket."""
        self._peer.close()
