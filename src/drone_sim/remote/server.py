"""ZeroMQ server, which handles clients' requests in the simulation's thread, between and during waits for steps."""

from __future__ import annotations

import contextlib
import logging
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

from drone_sim.remote import messages
from drone_sim.remote.client import Client
from drone_sim.remote.control import MovedObjects
from drone_sim.remote.conversation import RemoteApi, Stepping, Until, Watched, returned, unwatched
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
_MAX_MESSAGE_SIZE = 8 * 1024 * 1024  # bytes of a message; a client that sends more is disconnected
_MAX_QUEUED = 16  # queued messages of a client
_HEARTBEAT_INTERVAL = 2000  # ms, between checks that a client's machine is alive


class Incoming(NamedTuple):
    """A message, the envelope for its reply, and the number of its connection."""

    envelope: tuple[bytes, ...]
    connection: int
    payload: bytes


class Endpoint:
    """A ROUTER for the clients' REQ sockets. Only `wake` is thread-safe."""

    def __init__(self, address: str, port: int):
        """Listen on an address and a port (0: a free one). Raises OSError, in one line."""
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.ZAP_DOMAIN, b"drone_sim")  # rejects peers below ZMTP 3, and so all HTTP clients
        self._socket.setsockopt(zmq.MAXMSGSIZE, _MAX_MESSAGE_SIZE)
        self._socket.setsockopt(zmq.RCVHWM, _MAX_QUEUED)
        self._socket.setsockopt(zmq.HEARTBEAT_IVL, _HEARTBEAT_INTERVAL)
        self._disconnections = self._socket.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        self._awake, self._alarm = socket.socketpair()
        self._poller = zmq.Poller()
        for source in (self._socket, self._disconnections, self._awake):
            self._poller.register(source, zmq.POLLIN)
        for end in (self._awake, self._alarm):
            end.setblocking(False)
        try:
            self._socket.bind(f"tcp://{address}:{port or '*'}")
        except zmq.ZMQError as error:
            self.close()
            raise OSError(f"remote_api: cannot listen on {address}:{port}: {zmq.strerror(error.errno or 0)}") from None
        self.address = self._socket.getsockopt_string(zmq.LAST_ENDPOINT).removeprefix("tcp://")

    @property
    def port(self) -> int:
        return int(self.address.rpartition(":")[2])

    def watch(self, number: int) -> None:
        """Let `wait` also end when another file, given by its descriptor, is readable."""
        self._poller.register(number, zmq.POLLIN)

    def wait(self, seconds: float) -> None:
        """Sleep for `seconds`, or until a message arrives, a client disconnects, or `wake` is called."""
        milliseconds = int(1e3 * seconds)
        if not milliseconds:  # a sleep is more precise than a poll
            time.sleep(max(0.0, seconds))
            return
        for ready, _ in self._poller.poll(milliseconds):
            if ready == self._awake.fileno():
                self._awake.recv(4096)

    def wake(self) -> None:
        """End the current or next `wait`."""
        with contextlib.suppress(BlockingIOError, OSError):  # full, so it wakes anyway, or closed
            self._alarm.send(b"!")

    def receive(self) -> Incoming | None:
        """Return the next message, None if there is none."""
        if not _readable(self._socket):
            return None
        *envelope, payload = self._socket.recv_multipart(zmq.NOBLOCK, copy=False)
        return Incoming(tuple(frame.bytes for frame in envelope), int(payload.get(zmq.SRCFD)), payload.bytes)

    def send(self, envelope: tuple[bytes, ...], payload: bytes) -> None:
        """Send a reply; it is dropped if the client is gone."""
        with contextlib.suppress(zmq.ZMQError):
            self._socket.send_multipart([*envelope, payload], zmq.NOBLOCK)

    def ended(self) -> list[int]:
        """Return the numbers of connections that have closed since the last call."""
        connections = []
        while _readable(self._disconnections):
            connections.append(int(recv_monitor_message(self._disconnections, zmq.NOBLOCK)["value"]))
        return connections

    def close(self) -> None:
        self._socket.disable_monitor()
        self._disconnections.close(linger=0)
        self._socket.close()
        self._context.term()
        self._awake.close()
        self._alarm.close()


def _readable(source: zmq.Socket[bytes]) -> bool:
    """Return whether there is a message to receive; catching zmq.Again instead would be slower."""
    return bool(int(source.getsockopt(zmq.EVENTS)) & zmq.POLLIN)


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
        watched: Watched = unwatched,
    ):
        """Listen for clients that control `player`, on an address and a port (0: a free one).

        `backend` transports clients' ROS messages, `clock` returns real seconds; `watched` returns the function to
        call in place of a named function. Raises OSError.
        """
        self._player, self._watched = player, watched
        self._backend = backend
        self.moved = MovedObjects(player.simulation)
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
        self.moved.watch()
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
            client = Client(self._player, self.moved, self._backend, self.everybody, self._clock, self._watched)
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
