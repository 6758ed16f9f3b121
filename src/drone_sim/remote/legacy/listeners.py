"""The server's listening sockets: a permanent one, and those that scripts request."""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Iterable

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
        """Close all listening sockets."""
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
