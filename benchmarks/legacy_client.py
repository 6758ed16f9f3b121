"""A client of V-REP's legacy remote API, as far as the benchmark needs one: a call is one message."""

import socket
import struct

_HEADER, _COMMAND, _PACKET = struct.Struct("<HBiiiHB"), struct.Struct("<iiHiiHiBB"), struct.Struct("<hhh")
BLOCKING, STREAMING = 1 << 16, 2 << 16
HANDLE, POSITION, OBJECTS = 0x3001, 0x200E, 0x102A
TRIGGER, SYNCHRONOUS, TOOLBAR = 0x0003, 0x0001, 0x1007
START, STOP = struct.pack("<i", 0), struct.pack("<i", 2)


class LegacyClient:
    """Waits for each answer."""

    def __init__(self, port: int = 19997):
        """Connect to this machine."""
        self._peer = socket.create_connection(("127.0.0.1", port), timeout=30)
        self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._number = 0

    def ask(self, *commands: bytes) -> bytes:
        """Return the commands that come back."""
        content = _HEADER.pack(0, 11, self._number, 0, 0, 0, 0) + b"".join(commands)
        self._number += 1
        pieces = [content[start : start + 1294] for start in range(0, len(content), 1294)]
        left = len(pieces)
        self._peer.sendall(b"".join(_PACKET.pack(1, len(one), left - n) + one for n, one in enumerate(pieces, 1)))
        answer, more = b"", 1
        while more:
            _, size, more = _PACKET.unpack(self._read(_PACKET.size))
            answer += self._read(size)
        return answer[_HEADER.size :]

    def call(self, code: int, key: bytes = b"", data: bytes = b"") -> bytes:
        """Return what a command brings in the blocking mode."""
        return self.ask(command(code | BLOCKING, key, data))[_COMMAND.size + len(key) :]

    def _read(self, size: int) -> bytes:
        found = b""
        while len(found) < size:
            more = self._peer.recv(size - len(found))
            if not more:
                raise ConnectionError("the server has ended the connection")
            found += more
        return found


def command(code: int, key: bytes = b"", data: bytes = b"") -> bytes:
    """Return a command, whose code has its mode."""
    size = _COMMAND.size + len(key) + len(data)
    return _COMMAND.pack(size, size, len(key), 0, code, 0, 0, 0, 0) + key + data
