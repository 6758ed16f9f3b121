"""Sockets: a client's connection with its unsent replies, and the ports on which the server listens."""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Iterable

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
        self.name = name
        self.ended = False  # whether the client has closed it
        self._peer = peer
        self.packets = Packets()
        self._out = memoryview(b"")
        peer.setblocking(False)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in _KEEP_ALIVE:
            peer.setsockopt(socket.IPPROTO_TCP, option, value)

    def fileno(self) -> int:
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
        try:
            received = self._peer.recv(_READ_SIZE)
            # A client sends each packet when the last one is acknowledged: acknowledge at once, not after 40 ms.
            self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        except BlockingIOError:
            return
        except OSError:
            received = b""
        self.ended = not received
        self.packets.add(received)

    def send(self, message: bytes) -> None:
        """Send a reply, as far as the socket accepts it."""
        self._out = memoryview(self.packets.of(message))
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
        self._peer.close()


_LOG = logging.getLogger(__name__)
_BACKLOG = 256


class Listeners:
    """Listening sockets by file descriptor, as `epoll` reports them."""

    def __init__(self, host: str, epoll: select.epoll):
        """`host` is the address to listen on, '' for all; `epoll` reports new connections."""
        self._host, self._epoll = host, epoll
        self._listeners: dict[int, socket.socket] = {}
        self._ports: dict[int, int] = {}  # of scripts: file descriptor by port, -1 if not opened

    def __contains__(self, number: int) -> bool:
        """Return whether a file descriptor is that of a listening socket."""
        return number in self._listeners

    def open(self, port: int) -> int:
        """Listen on a port (0: a free one); return it. Raises OSError, in one line."""
        try:
            listener = socket.create_server((self._host, port), backlog=_BACKLOG)
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise OSError(f"remote_api: cannot listen on {self._host or '*'}:{port}: {why}") from None
        listener.setblocking(False)
        self._listeners[listener.fileno()] = listener
        self._epoll.register(listener.fileno(), select.EPOLLIN)
        return int(listener.getsockname()[1])

    def accept(self, number: int) -> tuple[socket.socket, str] | None:
        """Return a pending connection and its name; None if there is none. Raises OSError."""
        try:
            peer, (host, port) = self._listeners[number].accept()
        except BlockingIOError:
            return None
        return peer, f"{host}:{port}"

    def follow(self, wanted: Iterable[int]) -> list[int]:
        """Listen on exactly these ports for scripts; return the ports that were closed."""
        closed = [port for port in self._ports if port not in wanted]
        for port in closed:
            self._close(self._ports.pop(port))
        for port in wanted:
            if port not in self._ports:
                self._ports[port] = self._open_for_script(port)
        return closed

    def close(self) -> None:
        for number in list(self._listeners):
            self._close(number)

    def _open_for_script(self, port: int) -> int:
        """Open a port; return its file descriptor, -1 if it is open already or cannot be opened (logged once)."""
        if any(listener.getsockname()[1] == port for listener in self._listeners.values()):
            return -1
        try:
            self.open(port)
        except OSError as error:
            _LOG.error("%s, which a script requests", error)
            return -1
        return next(reversed(self._listeners))

    def _close(self, number: int) -> None:
        listener = self._listeners.pop(number, None)
        if listener is not None:
            self._epoll.unregister(number)
            listener.close()
