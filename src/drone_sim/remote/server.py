"""The server: in the simulation's thread it answers what clients ask, between two steps and while one is awaited."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from drone_sim.remote import messages
from drone_sim.remote.client import Client
from drone_sim.remote.control import MovedObjects
from drone_sim.remote.conversation import RemoteApi, Stepping, Until, Watched, returned, unwatched
from drone_sim.remote.endpoint import Endpoint, Incoming
from drone_sim.remote.messages import ClientRequest
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend

_LOG = logging.getLogger(__name__)
_MOST_CLIENTS = 100
_MOST_TASKS = 16  # of one socket: a client's function may call functions itself
_BATCH = 64  # messages; then a step may be due
_LOOK = 0.005  # s between two looks at what a client waits for
_SELDOM = 1.0  # s between two looks for clients that have fallen silent


class _Waiting(NamedTuple):
    client: Client
    envelope: tuple[bytes, ...]
    until: Until


class RemoteApiServer(RemoteApi):
    """Serves the remote API. One thread owns it, that of the simulation; `wake` alone may be called from any."""

    def __init__(
        self,
        player: Player,
        address: str,
        port: int,
        backend: Backend | None = None,
        clock: Callable[[], float] = time.monotonic,
        moved: MovedObjects | None = None,
        watched: Watched = unwatched,
    ):
        """Listen for clients that control a `player`, on an `address` and a `port` (0: a free one).

        `backend` carries clients' messages, `clock` counts real seconds, `moved` watches where objects are put;
        `watched` is what clients call instead of a function. Raises OSError.
        """
        self._player, self._watched = player, watched
        self._backend = backend
        self._moved = moved or MovedObjects(player.simulation)
        self._clients: dict[str, Client] = {}
        self._waiting: list[_Waiting] = []
        self._clock = clock
        self._seldom = Throttle(_SELDOM, clock)
        self._endpoint = Endpoint(address, port)
        self.address, self.port = self._endpoint.address, self._endpoint.port

    @property
    def holds(self) -> bool:
        """Whether a client wants to be asked before the next step, and has not said so yet."""
        return any(one.stepping.holds for one in self._clients.values())

    def watch(self, number: int) -> None:
        """Let a `wait` also end when another file can be read, given by its descriptor."""
        self._endpoint.watch(number)

    def wait(self, seconds: float) -> None:
        """Sleep for so long, or until something has been done for a client."""
        if not self._go_on_waiting():
            self._endpoint.wait(min(seconds, _LOOK) if self._waiting else seconds)
        self.serve()

    def serve(self) -> None:
        """Answer what has come by now."""
        self._moved.watch()
        self._forget()
        self._go_on_waiting()
        for _ in range(_BATCH):
            incoming = self._endpoint.receive()
            if incoming is None:
                return
            self._take(incoming)

    def wake(self) -> None:
        """End a `wait`; any thread may call it."""
        self._endpoint.wake()

    def close(self) -> None:
        """Let go of the clients, and of the port."""
        for client in self._clients.values():
            client.leave()
        self._clients.clear()
        self._endpoint.close()

    # ---- requests

    def _take(self, incoming: Incoming) -> None:
        envelope = incoming.envelope
        try:
            request = messages.read(incoming.payload)
            client = self._client(request, incoming)
        except ValueError as error:
            self._endpoint.send(envelope, messages.failure(str(error)))
            return
        if request.function == messages.EXECUTED:
            self._go_on(client, envelope, returned(request.arguments))
        elif request.function == messages.END:
            self._endpoint.send(envelope, messages.success([]))
            self._let_go(request.client)
        else:
            tasks = client.tasks.setdefault(envelope, [])
            if len(tasks) >= _MOST_TASKS:
                del tasks[0]  # the client's function failed: it has never come back to this one
            tasks.append(client.answer(request))
            self._go_on(client, envelope, None)

    def _go_on(self, client: Client, envelope: tuple[bytes, ...], value: Any) -> None:
        """Carry on with the newest task of a socket, and answer."""
        client.heard = self._clock()
        tasks = client.tasks.get(envelope)
        if not tasks:
            self._endpoint.send(envelope, messages.failure("no call of this client waits for a result"))
            return
        try:
            asked = tasks[-1].send(value)
            if isinstance(asked, Until):
                self._waiting.append(_Waiting(client, envelope, asked))
                return
            reply = messages.call(*asked)
        except StopIteration as done:
            tasks.pop()
            try:
                reply = messages.success(done.value)
            except ValueError as error:
                reply = messages.failure(str(error))
        except Exception as error:  # whatever it is, the flight goes on
            _LOG.debug("a request failed:", exc_info=True)
            tasks.pop()
            reply = messages.failure(" ".join(str(error).split()))
        if not tasks:
            client.tasks.pop(envelope, None)
        self._endpoint.send(envelope, reply)

    def _go_on_waiting(self) -> bool:
        """Answer those whose waiting is over; return whether there were any."""
        over = [one for one in self._waiting if one.until.over()] if self._waiting else []
        for one in over:
            self._waiting.remove(one)
            self._go_on(one.client, one.envelope, None)
        return bool(over)

    # ---- clients

    def _client(self, request: ClientRequest, incoming: Incoming) -> Client:
        """Return the client that a request is from. Raises ValueError where there are too many."""
        name = request.client or incoming.envelope[0].hex()
        client = self._clients.get(name)
        if client is None:
            if len(self._clients) >= _MOST_CLIENTS:
                raise ValueError(f"{_MOST_CLIENTS} clients are already connected")
            client = Client(self._player, self._moved, self._backend, self.everybody, self._clock, self._watched)
            client.patience = request.patience
            self._clients[name] = client
        client.connections.add(incoming.connection)
        return client

    def everybody(self) -> Iterator[Stepping]:
        """Yield the Stepping of each client."""
        return (one.stepping for one in self._clients.values())

    def _forget(self) -> None:
        """Let go of clients whose last connection has ended, and of those that have been silent for too long."""
        for number in self._endpoint.ended():
            for name, client in list(self._clients.items()):
                if number in client.connections:
                    client.connections.remove(number)
                    if not client.connections:
                        self._let_go(name)
        if self._seldom.passes():
            waiting = [one.client for one in self._waiting]
            for name, client in list(self._clients.items()):
                if self._clock() - client.heard > client.patience and client not in waiting:
                    self._let_go(name)

    def _let_go(self, name: str) -> None:
        client = self._clients.pop(name, None)
        if client is not None:
            client.leave()
            self._waiting = [one for one in self._waiting if one.client is not client]
