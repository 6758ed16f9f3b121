"""ZeroMQ server, which handles clients' requests in the simulation's thread, between and during waits for steps."""

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
_MAX_CLIENTS = 100
_MAX_TASKS = 16  # of a socket: a client's function may make requests itself
_BATCH = 64  # messages handled at once; then a step may be due
_CHECK_INTERVAL = 0.005  # s between checks of the conditions that clients wait for
_CLEANUP_INTERVAL = 1.0  # s between checks for silent clients


class _Waiting(NamedTuple):
    client: Client
    envelope: tuple[bytes, ...]
    until: Until


class RemoteApiServer(RemoteApi):
    """Server of the remote API, for the simulation's thread only; `wake` alone is thread-safe."""

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
        """Listen for clients that control `player`, on an address and a port (0: a free one).

        `backend` transports clients' ROS messages, `clock` returns real seconds, `moved` records moved objects;
        `watched` returns the function to call in place of a named function. Raises OSError.
        """
        self._player, self._watched = player, watched
        self._backend = backend
        self._moved = moved or MovedObjects(player.simulation)
        self._clients: dict[str, Client] = {}
        self._waiting: list[_Waiting] = []
        self._clock = clock
        self._cleanup = Throttle(_CLEANUP_INTERVAL, clock)
        self._endpoint = Endpoint(address, port)
        self.address, self.port = self._endpoint.address, self._endpoint.port

    @property
    def holds(self) -> bool:
        """Whether a client in stepping mode has not requested the next step yet."""
        return any(client.stepping.holds for client in self._clients.values())

    def watch(self, number: int) -> None:
        """Let `wait` also end when another file, given by its descriptor, is readable."""
        self._endpoint.watch(number)

    def wait(self, seconds: float) -> None:
        if not self._resume_waiting():
            self._endpoint.wait(min(seconds, _CHECK_INTERVAL) if self._waiting else seconds)
        self.serve()

    def serve(self) -> None:
        self._moved.watch()
        self._remove_lost_clients()
        self._resume_waiting()
        for _ in range(_BATCH):
            incoming = self._endpoint.receive()
            if incoming is None:
                return
            self._take(incoming)

    def wake(self) -> None:
        self._endpoint.wake()

    def close(self) -> None:
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
            self._resume(client, envelope, returned(request.arguments))
        elif request.function == messages.END:
            self._endpoint.send(envelope, messages.success([]))
            self._remove(request.client)
        else:
            tasks = client.tasks.setdefault(envelope, [])
            if len(tasks) >= _MAX_TASKS:
                del tasks[0]  # the client's function failed, so this task is never continued
            tasks.append(client.answer(request))
            self._resume(client, envelope, None)

    def _resume(self, client: Client, envelope: tuple[bytes, ...], value: Any) -> None:
        """Resume the newest task of a socket with `value`, and reply."""
        client.heard = self._clock()
        tasks = client.tasks.get(envelope)
        if not tasks:
            self._endpoint.send(envelope, messages.failure("no call of this client waits for a result"))
            return
        try:
            yielded = tasks[-1].send(value)
            if isinstance(yielded, Until):
                self._waiting.append(_Waiting(client, envelope, yielded))
                return
            reply = messages.call(*yielded)
        except StopIteration as done:
            tasks.pop()
            try:
                reply = messages.success(done.value)
            except ValueError as error:
                reply = messages.failure(str(error))
        except Exception as error:  # an error must not end the flight
            _LOG.debug("a request failed:", exc_info=True)
            tasks.pop()
            reply = messages.failure(" ".join(str(error).split()))
        if not tasks:
            client.tasks.pop(envelope, None)
        self._endpoint.send(envelope, reply)

    def _resume_waiting(self) -> bool:
        """Resume the tasks whose wait is over; return whether there were any."""
        ready = [waiting for waiting in self._waiting if waiting.until.over()] if self._waiting else []
        for waiting in ready:
            self._waiting.remove(waiting)
            self._resume(waiting.client, waiting.envelope, None)
        return bool(ready)

    # ---- clients

    def _client(self, request: ClientRequest, incoming: Incoming) -> Client:
        """Return the client of a request, created if new. Raises ValueError if there are too many."""
        name = request.client or incoming.envelope[0].hex()
        client = self._clients.get(name)
        if client is None:
            if len(self._clients) >= _MAX_CLIENTS:
                raise ValueError(f"{_MAX_CLIENTS} clients are already connected")
            client = Client(self._player, self._moved, self._backend, self.everybody, self._clock, self._watched)
            client.patience = request.patience
            self._clients[name] = client
        client.connections.add(incoming.connection)
        return client

    def everybody(self) -> Iterator[Stepping]:
        """Yield the Stepping of each client."""
        return (client.stepping for client in self._clients.values())

    def _remove_lost_clients(self) -> None:
        """Remove clients whose last connection has closed, and those silent for too long."""
        for number in self._endpoint.ended():
            for name, client in list(self._clients.items()):
                if number in client.connections:
                    client.connections.remove(number)
                    if not client.connections:
                        self._remove(name)
        if self._cleanup.passes():
            waiting = [item.client for item in self._waiting]
            for name, client in list(self._clients.items()):
                if self._clock() - client.heard > client.patience and client not in waiting:
                    self._remove(name)

    def _remove(self, name: str) -> None:
        client = self._clients.pop(name, None)
        if client is not None:
            client.leave()
            self._waiting = [item for item in self._waiting if item.client is not client]
