"""The ports that the server listens on: one all the time, and those that scripts ask for."""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Iterable

_LOG = logging.getLogger(__name__)
_BACKLOG = 256


class Doors:
    """Sockets that listen, by their file descriptors, as `epoll` reports them."""

    def __init__(self, host: str, epoll: select.epoll):
        """Take the address to listen on, '' for all of this machine's, and the `epoll` that reports new connections."""
        self._host, self._epoll = host, epoll
        self._doors: dict[int, socket.socket] = {}
        self._ports: dict[int, int] = {}  # those of scripts: by port the number, -1 where there is none

    def __contains__(self, number: int) -> bool:
        """Tell whether it is the number of a door."""
        return number in self._doors

    def open(self, port: int) -> int:
        """Listen on a port, 0 a free one; return it. Raises OSError, in one line."""
        try:
            door = socket.create_server((self._host, port), backlog=_BACKLOG)
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise OSError(f"remote_api: cannot listen on {self._host or '*'}:{port}: {why}") from None
        door.setblocking(False)
        self._doors[door.fileno()] = door
        self._epoll.register(door.fileno(), select.EPOLLIN)
        return int(door.getsockname()[1])

    def accept(self, number: int) -> tuple[socket.socket, str] | None:
        """Return who knocks at a door, and a name for it; None for nobody. Raises OSError."""
        try:
            peer, (host, port) = self._doors[number].accept()
        except BlockingIOError:
            return None
        return peer, f"{host}:{port}"

    def follow(self, wanted: Iterable[int]) -> list[int]:
        """Listen on the ports that scripts ask for, and no others of theirs; return those that were closed."""
        closed = [port for port in self._ports if port not in wanted]
        for port in closed:
            self._close(self._ports.pop(port))
        for port in wanted:
            if port not in self._ports:
                self._ports[port] = self._open_for_script(port)
        return closed

    def close(self) -> None:
        """Listen no more."""
        for number in list(self._doors):
            self._close(number)

    def _open_for_script(self, port: int) -> int:
        """Open a port; return its socket's number, -1 if it is open already or cannot be opened (logged once)."""
        if any(door.getsockname()[1] == port for door in self._doors.values()):
            return -1
        try:
            self.open(port)
        except OSError as error:
            _LOG.error("%s, as a script asks", error)
            return -1
        return next(reversed(self._doors))

    def _close(self, number: int) -> None:
        door = self._doors.pop(number, None)
        if door is not None:
            self._epoll.unregister(number)
            door.close()
