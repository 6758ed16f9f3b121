"""The socket that clients connect to; who has gone; and how the simulation's thread waits for both."""

from __future__ import annotations

import contextlib
import socket
import time
from typing import NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

_LARGEST = 8 * 1024 * 1024  # bytes of a message; whoever sends more is disconnected
_MOST = 16  # messages of a client that wait
_HEARTBEAT = 2000  # ms, between two questions whether a client's machine is still there


class Incoming(NamedTuple):
    """A message, the way back, and the number of the connection that it came by."""

    envelope: tuple[bytes, ...]
    connection: int
    payload: bytes


class Endpoint:
    """A ROUTER for the clients' REQ sockets. One thread owns it; `wake` alone may be called from any."""

    def __init__(self, address: str, port: int):
        """Listen on an `address`, and a `port`, of which 0 is a free one. Raises OSError, in one line."""
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.ZAP_DOMAIN, b"drone_sim")  # ends peers below ZMTP 3, among them all that speak HTTP
        self._socket.setsockopt(zmq.MAXMSGSIZE, _LARGEST)
        self._socket.setsockopt(zmq.RCVHWM, _MOST)
        self._socket.setsockopt(zmq.HEARTBEAT_IVL, _HEARTBEAT)
        self._ends = self._socket.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        self._awake, self._alarm = socket.socketpair()
        self._poller = zmq.Poller()
        for one in (self._socket, self._ends, self._awake):
            self._poller.register(one, zmq.POLLIN)
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
        """The port that it listens on."""
        return int(self.address.rpartition(":")[2])

    def watch(self, number: int) -> None:
        """Let a `wait` also end when another file can be read, given by its descriptor."""
        self._poller.register(number, zmq.POLLIN)

    def wait(self, seconds: float) -> None:
        """Sleep until a message comes, a client goes, somebody calls `wake`, or for so long."""
        milliseconds = int(1e3 * seconds)
        if not milliseconds:  # the steps of the clock are finer than those of a poll
            time.sleep(max(0.0, seconds))
            return
        for ready, _ in self._poller.poll(milliseconds):
            if ready == self._awake.fileno():
                self._awake.recv(4096)

    def wake(self) -> None:
        """End a `wait`, the next one if there is none."""
        with contextlib.suppress(BlockingIOError, OSError):  # full, so it wakes; or closed
            self._alarm.send(b"!")

    def receive(self) -> Incoming | None:
        """Return the next message, None where none waits."""
        if not _readable(self._socket):
            return None
        *envelope, payload = self._socket.recv_multipart(zmq.NOBLOCK, copy=False)
        return Incoming(tuple(one.bytes for one in envelope), int(payload.get(zmq.SRCFD)), payload.bytes)

    def send(self, envelope: tuple[bytes, ...], payload: bytes) -> None:
        """Send an answer; it is dropped if nobody waits for it any more."""
        with contextlib.suppress(zmq.ZMQError):
            self._socket.send_multipart([*envelope, payload], zmq.NOBLOCK)

    def ended(self) -> list[int]:
        """Return the connections that have ended since the last call."""
        found = []
        while _readable(self._ends):
            found.append(int(recv_monitor_message(self._ends, zmq.NOBLOCK)["value"]))
        return found

    def close(self) -> None:
        """Let go of port and clients."""
        self._socket.disable_monitor()
        self._ends.close(linger=0)
        self._socket.close()
        self._context.term()
        self._awake.close()
        self._alarm.close()


def _readable(one: zmq.Socket[bytes]) -> bool:
    """Tell whether there is something to receive; an exception that there is nothing would take longer."""
    return bool(int(one.getsockopt(zmq.EVENTS)) & zmq.POLLIN)
