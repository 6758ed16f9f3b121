"""Length-prefixed messages over a pair of sockets, and the simulation's connection to a script's process."""

from __future__ import annotations

import itertools
import marshal
import socket
import struct
from collections import deque
from collections.abc import Callable
from time import monotonic
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.rpc import values

LARGEST = 128 * 2**20  # bytes of a message: the largest image, as base64
_LENGTH = struct.Struct("<I")
_BLOCK = 2**16  # bytes; allocated for every message


class Disconnected(ConnectionError):
    """The connection is closed, or a message is invalid; the text, one line, says which."""


class Channel:
    """One end of the socket pair, used by a single thread."""

    def __init__(self, end: socket.socket, patience: float = 0.0):
        """Use the socket `end`. After `patience` s (0: never) `receive` returns None and `send` fails."""
        self._socket = end
        self._received = bytearray()
        end.setblocking(True)
        seconds = struct.pack("@ll", int(patience), int(patience % 1 * 1e6))
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            end.setsockopt(socket.SOL_SOCKET, option, seconds)

    def send(self, message: bytes) -> None:
        """Send a message. Raises Disconnected."""
        try:
            self._socket.sendall(_LENGTH.pack(len(message)) + message)
        except OSError:
            raise Disconnected("the other end has stopped reading") from None

    def receive(self) -> bytes | None:
        """Return the next message; None if it did not arrive in time. Raises Disconnected."""
        received = self._received
        while (end := self._end() if received else None) is None or len(received) < end:
            try:
                block = self._socket.recv(_BLOCK)
            except BlockingIOError:
                return None
            except OSError:
                block = b""
            if not block:
                raise Disconnected("the other end was closed")
            if not received and len(block) >= 4 and len(block) == 4 + _LENGTH.unpack_from(block)[0]:
                return block[4:]  # the usual case: exactly one message, not copied
            received += block
        message = bytes(received[4:end])
        del received[:end]
        return message

    def _end(self) -> int | None:
        """Return the end index of the message being received; None if its length is unknown. Raises Disconnected."""
        if len(self._received) < 4:
            return None
        length: int = _LENGTH.unpack_from(self._received)[0]
        if length > LARGEST:
            raise Disconnected(f"a message of {length} bytes is too large")
        return 4 + length

    def close(self) -> None:
        """Close the socket; a second call does nothing."""
        self._socket.close()


_CHECK_INTERVAL = 0.5  # s between checks of the deadline, while no message arrives
Permit = Callable[[str, list[Any]], Callable[[Any], None] | None]


def _all_permitted(_function: str, _arguments: list[Any]) -> None:
    pass


class ScriptConnection:
    """The simulation's end of the RPC: sends commands to a script's process and receives its requests."""

    def __init__(self, end: socket.socket, processor: int | None = None):
        """Use the socket `end`.

        `processor`: the CPU core of this process, None for any. The script's process uses it, too: only one of the two
        works at a time, and a message to another core takes ten times as long.
        """
        self._channel = Channel(end, _CHECK_INTERVAL)
        self.processor = processor
        self.objects = ObjectTree()
        self.permit: Permit = _all_permitted
        self.items: deque[list[Any]] = deque()  # received and not yet handled
        self.numbers = itertools.count(1)  # of the scripts in the script's process
        self.why_closed = ""  # a line of text; '' while open
        self.is_gone = False  # whether the script's process has ended or does not receive

    def begin(self, objects: ObjectTree, permit: Permit) -> None:
        """Set the objects of a flight, before its scripts are loaded.

        `permit` is called with a function's name and arguments before each call. It raises ValueError if the script may
        not make the call; it may return a function that is called with the result.
        """
        self.objects, self.permit = objects, permit

    def close(self, why: str) -> None:
        """Close the channel; later calls fail with `why`."""
        self.why_closed = self.why_closed or why
        self._channel.close()

    def send(self, message: tuple[Any, ...]) -> None:
        """Send a message. Raises Disconnected."""
        self._channel.send(marshal.dumps(message))

    def next_item(self, deadline: float) -> list[Any]:
        """Return the next item. Raises InvalidMessage, Disconnected, and TimeoutError after `deadline`."""
        while not self.items:
            if monotonic() > deadline:
                raise TimeoutError
            message = self._channel.receive()
            if message is not None:
                self.items.extend(values.read(message))
        return self.items.popleft()
