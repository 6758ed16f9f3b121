"""A client of V-REP's legacy remote API that sends the messages of a test and nothing else."""

import contextlib
import itertools
import socket
import struct

HEADER = struct.Struct("<HBiiiHB")
COMMAND = struct.Struct("<iiHiiHiBB")
PACKET = struct.Struct("<hhh")
ONESHOT, BLOCKING, STREAMING, SPLIT, STREAMING_SPLIT, DISCONTINUE = (mode << 16 for mode in range(6))
OK, NO_VALUE, FAILED = 0, 1, 8  # return codes of the official client's functions


def ints(*values):
    return struct.pack(f"<{len(values)}i", *values)


def floats(*values):
    return struct.pack(f"<{len(values)}f", *values)


def text(value):
    return value.encode() + b"\0"


def command(code, key=b"", data=b"", shift=0, whole=None):
    """Return an encoded command. `code` includes the mode, or is a pair of such a code and a delay in ms."""
    size = COMMAND.size + len(key) + len(data)
    full = size if whole is None else COMMAND.size + len(key) + whole
    number, delay = code if isinstance(code, tuple) else (code, 0)
    return COMMAND.pack(size, full, len(key), shift, number, delay, 0, 0, 0) + key + data


def message(number, *commands, version=11):
    return HEADER.pack(0, version, number, 1000 + number, 0, 0, 0) + b"".join(commands)


def packets(content, piece=1294):
    pieces = [content[start : start + piece] for start in range(0, len(content), piece)]
    return b"".join(PACKET.pack(1, len(chunk), len(pieces) - 1 - count) + chunk for count, chunk in enumerate(pieces))


class Reply:
    """A message of the server: its header, and the replies to commands by code (with the mode) and key."""

    def __init__(self, content):
        fields = HEADER.unpack_from(content)
        _, self.version, self.number, self.sent, self.time, self.scene, self.state = fields
        self.answers, self.times, at = {}, [], HEADER.size
        while at < len(content):
            size, full, key_size, shift, code, _, time, status, _ = COMMAND.unpack_from(content, at)
            assert (full, shift) == (size, 0)
            begin = at + COMMAND.size
            key, data = content[begin : begin + key_size], content[begin + key_size : at + size]
            self.answers[code, key] = FAILED if status & 1 else data
            self.times.append(time)
            at += size


class Client:
    """A client that calls `serve(seconds)` while it waits for a reply."""

    def __init__(self, port, serve):
        self.peer = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.peer.setblocking(False)
        self._serve = serve
        self._numbers = itertools.count()
        self._bytes = b""

    def send(self, *commands):
        self.send_bytes(packets(message(next(self._numbers), *commands)))

    def send_bytes(self, content):
        view = memoryview(content)
        while view:
            try:
                view = view[self.peer.send(view) :]
            except BlockingIOError:
                self._serve(0.001)

    def received(self, looks=2000):
        """Serve until a whole message has arrived and return it, or None after `looks` attempts."""
        for _ in range(looks):
            with contextlib.suppress(BlockingIOError):
                self._bytes += self.peer.recv(1 << 20)
            message_bytes = self._take()
            if message_bytes is not None:
                return Reply(message_bytes)
            self._serve(0.001)
        return None

    def _take(self):
        content, at = b"", 0
        while len(self._bytes) - at >= PACKET.size:
            first, size, left = PACKET.unpack_from(self._bytes, at)
            assert first == 1
            if len(self._bytes) < at + PACKET.size + size:
                return None
            content += self._bytes[at + PACKET.size : at + PACKET.size + size]
            at += PACKET.size + size
            if not left:
                self._bytes = self._bytes[at:]
                return content
        return None

    def ask(self, *commands):
        """Return the reply to a message with these commands."""
        self.send(*commands)
        reply = self.received()
        assert reply is not None
        return reply

    def call(self, code, key=b"", data=b""):
        """Return the data of the reply to a command in blocking mode, or FAILED."""
        return self.ask(command(code | BLOCKING, key, data)).answers[code | BLOCKING, key]

    def numbers(self, layout, code, key=b"", data=b""):
        """Return the numbers in the reply to a command."""
        answer = self.call(code, key, data)
        assert answer != FAILED, self.errors()
        return struct.unpack(f"<{layout}", answer)

    def handle(self, name):
        return self.numbers("i", 0x3001, text(name))[0]

    def errors(self):
        """Return the error messages since the last call."""
        answer = self.call(0x0004)
        (count,) = struct.unpack_from("<i", answer)
        lines = answer[4:].decode().split("\0")
        assert len(lines) == count + 1
        return lines[:-1]

    def is_let_go(self, looks=2000):
        """Serve until the server has closed the connection, at most `looks` times; return whether it has."""
        for _ in range(looks):
            try:
                if not self.peer.recv(1 << 20):
                    return True
            except BlockingIOError:
                pass
            except OSError:
                return True
            self._serve(0.001)
        return False

    def vanish(self):
        self.peer.close()
