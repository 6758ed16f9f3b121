"""One client's socket: what it has sent, and what it has not read yet."""

from __future__ import annotations

import socket

from drone_sim.remote.legacy.wire import Packets

_AT_ONCE = 256 * 1024  # bytes that are read
_DEAD_AFTER = (  # a machine that is lost: s of silence, s between questions, times, ms for what it does not take
    (socket.TCP_KEEPIDLE, 2),
    (socket.TCP_KEEPINTVL, 2),
    (socket.TCP_KEEPCNT, 3),
    (socket.TCP_USER_TIMEOUT, 30_000),
)


class Connection:
    """A client's socket; while an answer has not been sent completely, no further requests are read."""

    def __init__(self, peer: socket.socket, name: str):
        """Take a connected socket, and what it is called in the log."""
        self.name = name
        self.ended = False  # whether nothing more comes
        self._peer = peer
        self._packets = Packets()
        self._out = memoryview(b"")
        peer.setblocking(False)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in _DEAD_AFTER:
            peer.setsockopt(socket.IPPROTO_TCP, option, value)

    def fileno(self) -> int:
        """Return the socket's number."""
        return self._peer.fileno()

    @property
    def port(self) -> int:
        """Our port, which the client has connected to."""
        return int(self._peer.getsockname()[1])

    @property
    def has_to_write(self) -> bool:
        """Whether an answer waits for the client to read."""
        return len(self._out) > 0

    def receive(self) -> None:
        """Take what has come."""
        try:
            received = self._peer.recv(_AT_ONCE)
            # Clients send packet by packet, each when the one before has been acknowledged: at once, not after 40 ms.
            self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        except BlockingIOError:
            return
        except OSError:
            received = b""
        self.ended = not received
        self._packets.add(received)

    def take(self) -> bytes | None:
        """Return the next message, None before it is all there. Raises ValueError for what is none."""
        return self._packets.take()

    def send(self, message: bytes) -> None:
        """Send an answer, as far as the client reads it."""
        self._out = memoryview(self._packets.of(message))
        self.flush()

    def flush(self) -> None:
        """Send what has not gone out yet."""
        try:
            while self._out:
                self._out = self._out[self._peer.send(self._out) :]
        except BlockingIOError:
            return
        except OSError:
            self.ended, self._out = True, memoryview(b"")

    def close(self) -> None:
        """Let go of it."""
        self._peer.close()
