"""What goes over the wire: packets, the messages that they carry, and the commands in a message.

All numbers are little-endian. A packet is 1, its size and how many more of the message follow (three of 16 bits), and a
piece of the message. A message is a header and commands; the server answers each with one message, in which a command
comes back with what it returned. What comes behind a command's own header is its key, which says what it is about
(nothing, a number or two, a text, or a number and two texts: its code says which), and its data.
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

LARGEST = 8 * 1024 * 1024  # bytes of a message
VERSION = 11  # of the protocol
_MOST_COMMANDS = 2000  # of a message
_PACKET = struct.Struct("<hhh")
_PIECE, _OLD_PIECE = (
    30_000,
    244,
)  # bytes of a message in a packet that is sent; V-REP 3.1's clients have room for no more
_MOST_PACKETS = 2**15 - 1  # of a message
_HEADER = struct.Struct(
    "<HBiiiHB"
)  # check sum (of V-REP 3.1's clients), version, number, client's time, server's time, scene, state
_COMMAND = struct.Struct("<iiHiiHiBB")  # size, size of the whole, key's, shift, code and mode, delay, time, status, 0
_FAILED = 1  # of a status
_CODE = 0xFFFF

# The modes, in which a command asks to be carried out.
ONESHOT, BLOCKING, STREAMING, ONESHOT_SPLIT, STREAMING_SPLIT, DISCONTINUE = range(6)
_MODES = range(6)

_Key = tuple[int | str, ...]
# What the key of a command is, by the first code that has it: numbers before, texts behind.
_KEYS = ((0x0000, 0, 0), (0x1000, 1, 0), (0x2000, 2, 0), (0x3000, 0, 1), (0x3400, 1, 2), (0x3500, 0, 1))
_OTHERS = {0x000A: (1, 0), 0x2003: (1, 0)}  # codes whose key is none of their kind: goodbye, and simxGetUIEventButton


class Command(NamedTuple):
    """What a client asks for.

    delay: ms between two answers to a command that streams; raw_key: the key as it came; whole: bytes of all its data,
    of which `data` begin at `shift`.
    """

    code: int
    mode: int
    delay: int
    key: _Key
    raw_key: bytes
    data: bytes
    shift: int = 0
    whole: int = 0

    @property
    def is_whole(self) -> bool:
        """Whether these are all of its data."""
        return self.shift == 0 and len(self.data) == self.whole


class Message(NamedTuple):
    """A client's: its number, when it was sent (ms of the client's clock), and what it asks for."""

    number: int
    sent: int
    commands: list[Command]


class Answer(NamedTuple):
    """What became of a command; `data` is None where it failed."""

    command: Command
    data: bytes | None


class Stamp(NamedTuple):
    """What every message of the server's says: its clock and the simulation's (ms), the scene, and bits of its state.

    The bits: 1 not stopped, 2 paused, 4 at real time.
    """

    time: int
    simulated: int
    scene: int
    state: int


class Packets:
    """Joins the packets of a connection into messages, and splits answers into packets that its client can read."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._is_old = False  # whether the client sends check sums, and drops what has none: V-REP 3.1's, and before
        self._bytes = bytearray()
        self._at = 0  # where the next packet begins
        self._message = bytearray()
        self._left: int | None = None  # packets of the message that has begun

    def add(self, received: bytes) -> None:
        """Take what has been received."""
        del self._bytes[: self._at]
        self._at = 0
        self._bytes += received

    def take(self) -> bytes | None:
        """Return the next message, None before it is all there. Raises ValueError, in one line, for what is none."""
        while len(self._bytes) - self._at >= _PACKET.size:
            first, size, left = _PACKET.unpack_from(self._bytes, self._at)
            self._check(first, size, left)
            begin = self._at + _PACKET.size
            if len(self._bytes) < begin + size:
                return None
            self._message += self._bytes[begin : begin + size]
            self._at, self._left = begin + size, left
            if not left:
                message, self._left = bytes(self._message), None
                self._message.clear()
                self._is_old = self._is_old or any(message[:2])
                return message
        return None

    def of(self, answer: bytes) -> bytes:
        """Return an answer in packets."""
        if not self._is_old:
            return packets(answer, _PIECE)
        check_sum = struct.pack("<H", binascii.crc_hqx(answer[2:], 0))
        return packets(check_sum + answer[2:], max(_OLD_PIECE, -(-len(answer) // _MOST_PACKETS)))

    def _check(self, first: int, size: int, left: int) -> None:
        if first != 1:
            raise ValueError(f"malformed packet: it begins with {first & _CODE:#06x}, must begin with 0x0001")
        if size <= 0 or left < 0:
            raise ValueError(f"malformed packet: {size} bytes, followed by {left} packets")
        if self._left is not None and left != self._left - 1:
            raise ValueError(
                f"malformed packet: {left} packets must follow it, but the one before announced {self._left - 1}"
            )
        if len(self._message) + size > LARGEST:
            raise ValueError(f"a message has more than {LARGEST} bytes")


def packets(message: bytes, piece: int) -> bytes:
    """Return a message in packets, so many bytes of it in each."""
    pieces = [message[start : start + piece] for start in range(0, len(message), piece)]
    left = len(pieces)
    return b"".join(_PACKET.pack(1, len(one), left - count) + one for count, one in enumerate(pieces, 1))


def read(message: bytes) -> Message:
    """Return what a message says. Raises ValueError, in one line, for what is none."""
    if len(message) < _HEADER.size:
        raise ValueError(f"malformed message: {len(message)} bytes, but a header alone has {_HEADER.size}")
    _, _, number, sent, *_ = _HEADER.unpack_from(message)
    commands: list[Command] = []
    for command in _commands(message):
        commands.append(command)
        if len(commands) > _MOST_COMMANDS:
            raise ValueError(f"a message has more than {_MOST_COMMANDS} commands")
    return Message(number, sent, commands)


def _commands(message: bytes) -> Iterator[Command]:
    at = _HEADER.size
    while at < len(message):
        if len(message) - at < _COMMAND.size:
            raise ValueError(f"malformed message: its last {len(message) - at} bytes are not a command")
        size, whole, key_size, shift, code, delay, *_ = _COMMAND.unpack_from(message, at)
        begin, end = at + _COMMAND.size, at + size
        if size < _COMMAND.size or end > len(message) or key_size > end - begin:
            raise ValueError(
                f"malformed command: {size} bytes, key of {key_size} bytes, {len(message) - at} bytes left"
            )
        raw_key, data = message[begin : begin + key_size], message[begin + key_size : end]
        whole -= _COMMAND.size + key_size
        if not 0 <= shift <= whole - len(data) or whole > LARGEST:
            raise ValueError(f"malformed command: {len(data)} bytes at offset {shift} of {whole}")
        mode = code >> 16
        if mode not in _MODES:
            raise ValueError(f"a command has the unknown mode {mode}")
        yield Command(code & _CODE, mode, delay, _key(code & _CODE, raw_key), raw_key, data, shift, whole)
        at = end


def _key(code: int, raw: bytes) -> _Key:
    """Return a command's key. Raises ValueError where it is not what such a command has."""
    kinds = ((numbers, texts) for first, numbers, texts in reversed(_KEYS) if code >= first)
    count, texts = _OTHERS.get(code) or next(kinds)
    size = 4 * count
    *parts, rest = raw[size:].split(b"\0", texts) if texts else [raw[size:]]
    if len(raw) < size or len(parts) != texts or rest:
        raise ValueError(f"malformed payload for command {code:#06x}: a key of {len(raw)} bytes")
    return *struct.unpack_from(f"<{count}i", raw), *(part.decode("utf-8", "replace") for part in parts)


def write(to: Message, answers: Sequence[Answer], stamp: Stamp) -> bytes:
    """Return the message that answers one."""
    parts = [_HEADER.pack(0, VERSION, to.number, to.sent, stamp.time, stamp.scene, stamp.state)]
    for command, data in answers:
        key = command.raw_key
        size = _COMMAND.size + len(key) + len(data or b"")
        code = command.code | command.mode << 16
        status = _FAILED if data is None else 0
        parts.append(_COMMAND.pack(size, size, len(key), 0, code, command.delay, stamp.simulated, status, 0))
        parts += key, data or b""
    return b"".join(parts)
