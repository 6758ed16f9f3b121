"""The ZeroMQ socket for clients, the detection of closed connections, and waiting for both."""

from __future__ import annotations

import contextlib
import socket
import time
from typing import NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

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
