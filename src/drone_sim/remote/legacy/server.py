"""The server: in the simulation's thread it hears whoever has connected by `simxStart`."""

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
from drone_sim.remote.legacy.connection import Connection
from drone_sim.remote.legacy.doors import Doors
from drone_sim.remote.legacy.session import Session
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_MOST_CLIENTS = 100
_MOST_AT_ONCE = 256  # that are let in between two steps
_LONGEST = 0.005  # s that are spent on clients between two steps, where they ask for more
_SELDOM = 1.0  # s between two lines on who was let go, and between two looks for clients that have fallen silent
_SILENT = 600.0  # s without a word, after which a client counts as gone
_GONE = select.EPOLLRDHUP | select.EPOLLHUP | select.EPOLLERR


@dataclass
class _Guest:
    """A client that is connected, and what it waits for."""

    connection: Connection
    session: Session
    heard: float  # s
    port: int
    has_spoken: bool = False  # a whole message
    events: int = select.EPOLLIN | select.EPOLLRDHUP
    task: Task | None = None
    until: Until | None = None

    @property
    def waits(self) -> bool:
        """Whether it has asked for something that is not over."""
        return self.until is not None and not self.until.over()


class LegacyServer(RemoteApi):
    """Serves `simxStart`. One thread owns it, that of the simulation; `fileno` is readable when there is work."""

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
        """Listen for clients that control a `player`, on an `address` ("*": all) and a `port` (0: a free one).

        `moved` watches where objects are put; `others` returns the Stepping of each client of other servers, to release
        it when the simulation stops; `clock` counts real seconds; `watched` returns what clients call instead of a
        function. Raises OSError, in one line.
        """
        self._player, self._clock, self._others, self._watched = player, clock, others, watched
        self._moved = moved or MovedObjects(player.simulation)
        self._selected: list[int] = []
        self._seldom, self._rarely, self._unsaid = Throttle(_SELDOM, clock), Throttle(_SELDOM, clock), 0
        self._epoll = select.epoll()
        self._doors = Doors("" if address == "*" else address, self._epoll)
        self._guests: dict[int, _Guest] = {}
        self._unheard: dict[int, None] = {}  # guests who may have sent more than was looked at, in turn
        self.port = self._doors.open(port)
        self.address = f"{address}:{self.port}"

    def fileno(self) -> int:
        """Return the number of what is readable when somebody has to be heard."""
        return self._epoll.fileno()

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait for a client."""
        return any(one.session.holds for one in self._guests.values())

    @property
    def has_work(self) -> bool:
        """Whether something is to be done at once, though nobody has sent anything."""
        return bool(self._unheard) or any(one.until and one.until.over() for one in self._guests.values())

    def wait(self, seconds: float) -> None:
        """Sleep for so long, or until something has been done for a client."""
        if not self.has_work:
            self._epoll.poll(seconds)
        self.serve()

    def serve(self) -> None:
        """Hear who has come, and answer what they ask, as far as time allows."""
        self._moved.watch()
        self._follow_scripts()
        for guest in [one for one in self._guests.values() if one.until and one.until.over()]:
            self._go_on(guest)
        for number, event in self._epoll.poll(0):
            if number in self._doors:
                self._let_in(number)
            else:
                self._look_after(number, event)
        self._hear()
        if self._seldom.passes():
            self._forget_silent()

    def close(self) -> None:
        """Let go of the clients, and of the ports."""
        for guest in list(self._guests.values()):
            self._let_go(guest)
        self._doors.close()
        self._epoll.close()

    # ---- who comes and goes

    def _follow_scripts(self) -> None:
        """Listen where scripts ask for it, as long as the simulation runs."""
        ports = self._player.simulation.context.remote_ports
        wanted = ports.wanted if self._player.simulation.running else {}
        closed = self._doors.follow(wanted)
        for guest in [one for one in self._guests.values() if one.port in closed and one.port != self.port]:
            self._let_go(guest)
        if wanted:
            ports.connected = {one.port for one in self._guests.values()}

    def _let_in(self, door: int) -> None:
        for _ in range(_MOST_AT_ONCE):
            try:
                known = self._doors.accept(door)
            except OSError as error:  # it has gone already, or there are too many files
                self._say(f"cannot accept a client: {error.strerror}")
                return
            if known is None:
                return
            peer, name = known
            if len(self._guests) < _MOST_CLIENTS or self._make_room():
                self._seat(Connection(peer, name))
            else:
                peer.close()
                self._say(f"{name} is refused: {_MOST_CLIENTS} clients are already connected")

    def _make_room(self) -> bool:
        """Let go of somebody who has not said anything yet; return whether there was one."""
        for guest in self._guests.values():
            if not guest.has_spoken:
                self._let_go(guest, f"{_MOST_CLIENTS} clients are connected, and this one has not sent anything")
                return True
        return False

    def _seat(self, connection: Connection) -> None:
        client = Client(self._player, self._moved, None, self._others, self._clock, self._watched)
        name = f"the remote API's client {connection.name}"
        session = Session(name, client, self._player, self._selected, self._clock)
        port = connection.port
        wanted = self._player.simulation.context.remote_ports.wanted
        session.synchronous(wanted.get(port, False))
        guest = self._guests[connection.fileno()] = _Guest(connection, session, self._clock(), port)
        self._epoll.register(connection.fileno(), guest.events)

    def _let_go(self, guest: _Guest, why: str = "") -> None:
        number = guest.connection.fileno()
        self._epoll.unregister(number)
        del self._guests[number]
        self._unheard.pop(number, None)
        guest.session.leave()
        guest.connection.close()
        if why:
            self._say(f"{guest.connection.name} is disconnected: {why}")

    def _forget_silent(self) -> None:
        for guest in list(self._guests.values()):
            if self._clock() - guest.heard > _SILENT and not guest.waits:
                self._let_go(guest, f"silent for {_SILENT:.0f} s")

    def _say(self, line: str) -> None:
        """Write a line to the log, at most one per second, so that clients cannot flood it."""
        if self._rarely.passes():
            more = f" ({self._unsaid} similar lines were left out)" if self._unsaid else ""
            self._unsaid = 0
            _LOG.warning("remote API: %s%s", printable(line), more)
        else:
            self._unsaid += 1

    # ---- what they ask

    def _look_after(self, number: int, event: int) -> None:
        """Read what a guest has sent, send what it has not read, or let it go."""
        guest = self._guests.get(number)
        if guest is None:
            return
        if event & select.EPOLLOUT:
            guest.connection.flush()
            self._unheard[number] = None
        if event & select.EPOLLIN:
            guest.connection.receive()
            guest.heard = self._clock()
            self._unheard[number] = None
        if (event & _GONE and not event & select.EPOLLIN) or (guest.connection.ended and guest.task):
            self._let_go(guest)
        else:
            self._watch(guest)

    def _hear(self) -> None:
        """Answer what has been sent, until all has been heard or time is over."""
        end = self._clock() + _LONGEST
        while self._unheard:
            for number in list(self._unheard):
                if number in self._guests:
                    self._hear_one(self._guests[number])
                if self._clock() > end:
                    return

    def _hear_one(self, guest: _Guest) -> None:
        self._unheard.pop(guest.connection.fileno(), None)  # who is heard again comes behind the others
        if guest.task or guest.connection.has_to_write:
            return
        try:
            message = guest.connection.take()
        except ValueError as error:
            self._let_go(guest, str(error))
            return
        if message is not None:
            guest.has_spoken = True
            guest.task = guest.session.answer(message)
            self._go_on(guest)
        elif guest.connection.ended:
            self._let_go(guest)

    def _go_on(self, guest: _Guest) -> None:
        """Carry on with what a guest has asked for, and answer it."""
        guest.until = None
        try:
            asked = next(guest.task) if guest.task else None
            guest.until = asked if isinstance(asked, Until) else None
            self._watch(guest)
            return
        except StopIteration as done:
            guest.task = None
            guest.connection.send(done.value)
        except ValueError as error:
            self._let_go(guest, str(error))
            return
        except Exception as error:  # whatever it is, the flight goes on
            _LOG.debug("a request failed:", exc_info=True)
            self._let_go(guest, " ".join(str(error).split()) or type(error).__name__)
            return
        self._unheard[guest.connection.fileno()] = None
        if guest.session.is_over and not guest.connection.has_to_write:
            self._let_go(guest)
        else:
            self._watch(guest)

    def _watch(self, guest: _Guest) -> None:
        """Wake up for the right events of a guest: reading if no request is in progress, writing if an answer waits."""
        events = select.EPOLLRDHUP
        if guest.connection.has_to_write:
            events |= select.EPOLLOUT
        elif not guest.task:
            events |= select.EPOLLIN
        if events != guest.events:
            guest.events = events
            self._epoll.modify(guest.connection.fileno(), events)
