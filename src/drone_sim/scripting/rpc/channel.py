"""Length-prefixed messages over a pair of connected sockets."""

from __future__ import annotations

import socket
import struct

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
