"""Server of the legacy remote API (`simxStart`), which runs in the simulation's thread."""

from __future__ import annotations

import logging
import select
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drone_sim.message_text import printable
from drone_sim.remote.client import Client
from drone_sim.remote.control import MovedObjects
from drone_sim.remote.conversation import RemoteApi, Stepping, Task, Until, Watched, unwatched
from drone_sim.remote.legacy.connection import Connection, Listeners
from drone_sim.remote.legacy.session import Session
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_MAX_CLIENTS = 100
_MAX_ACCEPTED = 256  # connections accepted between two steps
_TIME_SLICE = 0.005  # s for clients' requests between two steps, at most
_INTERVAL = 1.0  # s between checks for silent clients, and between log lines about clients
_MAX_SILENCE = 600.0  # s without a message after which a client is disconnected
_GONE = select.EPOLLRDHUP | select.EPOLLHUP | select.EPOLLERR


@dataclass
class _Guest:
    """A connected client, and what it waits for."""

    connection: Connection
    session: Session
    heard: float  # s, time of its last message
    port: int
    has_spoken: bool = False  # whether it has sent a complete message
    events: int = select.EPOLLIN | select.EPOLLRDHUP
    task: Task | None = None
    until: Until | None = None

    @property
    def waits(self) -> bool:
        """Whether it waits for a condition that is not true yet."""
        return self.until is not None and not self.until.over()


class LegacyServer(RemoteApi):
    """Server for `simxStart`, for the simulation's thread only; `fileno` is readable when there is work."""

    def __init__(
        self,
        player: Player,
        address: str,
        port: int,
        moved: MovedObjects | None = None,
        others: Callable[[], Iterable[Stepping]] = tuple,
        clock: Callable[[], float] = time.monotonic,
        watched: Watched = unwatched,
    ):
        """Listen for clients that control `player`, on an address ("*": all) and a port (0: a free one).

        `moved` records moved objects; `others` returns the Stepping of other servers' clients, to release them when the
        simulation stops; `clock` returns real seconds; `watched` returns the function to call in place of a named one.
        Raises OSError, in one line.
        """
        self._player, self._clock, self._others, self._watched = player, clock, others, watched
        self._moved = moved or MovedObjects(player.simulation)
        self._selected: list[int] = []
        self._cleanup, self._log_limit, self._suppressed = Throttle(_INTERVAL, clock), Throttle(_INTERVAL, clock), 0
        self._epoll = select.epoll()
        self._listeners = Listeners("" if address == "*" else address, self._epoll)
        self._guests: dict[int, _Guest] = {}
        self._pending: dict[int, None] = {}  # descriptors of clients that may have sent unread messages, in turn
        self.port = self._listeners.open(port)
        self.address = f"{address}:{self.port}"

    def fileno(self) -> int:
        """Return the file descriptor that is readable when there is work."""
        return self._epoll.fileno()

    @property
    def holds(self) -> bool:
        return any(guest.session.stepping.holds for guest in self._guests.values())

    @property
    def has_work(self) -> bool:
        """Whether there is work that `fileno` does not signal."""
        return bool(self._pending) or any(guest.until and guest.until.over() for guest in self._guests.values())

    def wait(self, seconds: float) -> None:
        if not self.has_work:
            self._epoll.poll(seconds)
        self.serve()

    def serve(self) -> None:
        """Accept new clients, and handle requests received, as far as time allows."""
        self._moved.watch()
        self._follow_scripts()
        for guest in [guest for guest in self._guests.values() if guest.until and guest.until.over()]:
            self._resume(guest)
        for number, event in self._epoll.poll(0):
            if number in self._listeners:
                self._accept(number)
            else:
                self._handle_event(number, event)
        self._handle_messages()
        if self._cleanup.passes():
            self._disconnect_silent()

    def close(self) -> None:
        for guest in list(self._guests.values()):
            self._disconnect(guest)
        self._listeners.close()
        self._epoll.close()

    # ---- connections

    def _follow_scripts(self) -> None:
        """Listen on the ports that scripts request, while the simulation runs."""
        ports = self._player.simulation.context.remote_ports
        wanted = ports.wanted if self._player.simulation.running else {}
        closed = self._listeners.follow(wanted)
        for guest in [guest for guest in self._guests.values() if guest.port in closed and guest.port != self.port]:
            self._disconnect(guest)
        if wanted:
            ports.connected = {guest.port for guest in self._guests.values()}

    def _accept(self, listener: int) -> None:
        for _ in range(_MAX_ACCEPTED):
            try:
                accepted = self._listeners.accept(listener)
            except OSError as error:  # the client is gone already, or too many files are open
                self._log(f"cannot accept a client: {error.strerror}")
                return
            if accepted is None:
                return
            peer, name = accepted
            if len(self._guests) < _MAX_CLIENTS or self._make_room():
                self._add(Connection(peer, name))
            else:
                peer.close()
                self._log(f"{name} is refused: {_MAX_CLIENTS} clients are already connected")

    def _make_room(self) -> bool:
        """Disconnect a client that has not sent a message yet; return whether there was one."""
        for guest in self._guests.values():
            if not guest.has_spoken:
                self._disconnect(guest, f"{_MAX_CLIENTS} clients are connected, and this one has not sent anything")
                return True
        return False

    def _add(self, connection: Connection) -> None:
        client = Client(self._player, self._moved, None, self._others, self._clock, self._watched)
        name = f"the remote API's client {connection.name}"
        session = Session(name, client, self._player, self._selected, self._clock)
        wanted = self._player.simulation.context.remote_ports.wanted
        session.synchronous(wanted.get(connection.port, False))
        guest = self._guests[connection.fileno()] = _Guest(connection, session, self._clock(), connection.port)
        self._epoll.register(connection.fileno(), guest.events)

    def _disconnect(self, guest: _Guest, why: str = "") -> None:
        number = guest.connection.fileno()
        self._epoll.unregister(number)
        del self._guests[number]
        self._pending.pop(number, None)
        guest.session.leave()
        guest.connection.close()
        if why:
            self._log(f"{guest.connection.name} is disconnected: {why}")

    def _disconnect_silent(self) -> None:
        for guest in list(self._guests.values()):
            if self._clock() - guest.heard > _MAX_SILENCE and not guest.waits:
                self._disconnect(guest, f"silent for {_MAX_SILENCE:.0f} s")

    def _log(self, line: str) -> None:
        """Write a line to the log, at most one per second, so that clients cannot flood it."""
        if self._log_limit.passes():
            more = f" ({self._suppressed} similar lines were left out)" if self._suppressed else ""
            self._suppressed = 0
            _LOG.warning("remote API: %s%s", printable(line), more)
        else:
            self._suppressed += 1

    # ---- requests

    def _handle_event(self, number: int, event: int) -> None:
        """Read from a client's socket, write to it, or disconnect it."""
        guest = self._guests.get(number)
        if guest is None:
            return
        if event & select.EPOLLOUT:
            guest.connection.flush()
            self._pending[number] = None
        if event & select.EPOLLIN:
            guest.connection.receive()
            guest.heard = self._clock()
            self._pending[number] = None
        if (event & _GONE and not event & select.EPOLLIN) or (guest.connection.ended and guest.task):
            self._disconnect(guest)
        else:
            self._watch(guest)

    def _handle_messages(self) -> None:
        """Handle received messages until there are none or the time slice is over."""
        end = self._clock() + _TIME_SLICE
        while self._pending:
            for number in list(self._pending):
                if number in self._guests:
                    self._handle_message(self._guests[number])
                if self._clock() > end:
                    return

    def _handle_message(self, guest: _Guest) -> None:
        self._pending.pop(guest.connection.fileno(), None)  # added again at the end, behind the others
        if guest.task or guest.connection.has_to_write:
            return
        try:
            message = guest.connection.packets.take()
        except ValueError as error:
            self._disconnect(guest, str(error))
            return
        if message is not None:
            guest.has_spoken = True
            guest.task = guest.session.answer(message)
            self._resume(guest)
        elif guest.connection.ended:
            self._disconnect(guest)

    def _resume(self, guest: _Guest) -> None:
        """Resume a client's request, and reply when it is finished."""
        guest.until = None
        try:
            wait = next(guest.task) if guest.task else None
            guest.until = wait if isinstance(wait, Until) else None
            self._watch(guest)
            return
        except StopIteration as done:
            guest.task = None
            guest.connection.send(done.value)
        except ValueError as error:
            self._disconnect(guest, str(error))
            return
        except Exception as error:  # an error must not end the flight
            _LOG.debug("a request failed:", exc_info=True)
            self._disconnect(guest, " ".join(str(error).split()) or type(error).__name__)
            return
        self._pending[guest.connection.fileno()] = None
        if guest.session.is_over and not guest.connection.has_to_write:
            self._disconnect(guest)
        else:
            self._watch(guest)

    def _watch(self, guest: _Guest) -> None:
        """Watch for writability if a reply is unsent, for readability if no request is in progress."""
        events = select.EPOLLRDHUP
        if guest.connection.has_to_write:
            events |= select.EPOLLOUT
        elif not guest.task:
            events |= select.EPOLLIN
        if events != guest.events:
            guest.events = events
            self._epoll.modify(guest.connection.fileno(), events)
