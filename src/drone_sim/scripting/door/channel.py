"""Messages over a pair of connected sockets: their lengths, and their bytes."""

from __future__ import annotations

import socket
import struct

LARGEST = 128 * 2**20  # bytes of a message: a picture of the largest size, as text
_LENGTH = struct.Struct("<I")
_BLOCK = 2**16  # bytes, which are allocated for every message


class Disconnected(ConnectionError):
    """Nothing comes through any more, or what comes is no message; one line says which."""


class Channel:
    """One end of the pair; one thread uses it."""

    def __init__(self, end: socket.socket, patience: float = 0.0):
        """Take an end. `patience`: s after which `receive` gives None, and `send` gives up; 0 for ever."""
        self._socket = end
        self._came = bytearray()
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
        """Return the next message; None where none has come in time. Raises Disconnected."""
        came = self._came
        while (end := self._end() if came else None) is None or len(came) < end:
            try:
                block = self._socket.recv(_BLOCK)
            except BlockingIOError:
                return None
            except OSError:
                block = b""
            if not block:
                raise Disconnected("the other end was closed")
            if not came and len(block) >= 4 and len(block) == 4 + _LENGTH.unpack_from(block)[0]:
                return block[4:]  # most often
            came += block
        message = bytes(came[4:end])
        del came[:end]
        return message

    def _end(self) -> int | None:
        """Return where the message that is being received ends; None if not known yet. Raises Disconnected."""
        if len(self._came) < 4:
            return None
        length: int = _LENGTH.unpack_from(self._came)[0]
        if length > LARGEST:
            raise Disconnected(f"a message of {length} bytes is too large")
        return 4 + length

    def close(self) -> None:
        """Close this end; may be called twice."""
        self._socket.close()
