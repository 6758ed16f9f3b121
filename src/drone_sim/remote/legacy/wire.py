"""Wire format: packets, messages and commands.

All numbers are little-endian. A packet is the number 1, its size, the number of following packets of the message (three
16-bit integers), and a piece of the message. A message is a header and commands; the server replies to each with a
message, in which each command returns with its result. After a command's header follow its key, which identifies its
object (nothing, one or two numbers, a string, or a number and two strings, depending on its code), and its data.
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

LARGEST = 8 * 1024 * 1024  # bytes of a message
VERSION = 11  # of the protocol
_MAX_COMMANDS = 2000  # of a message
_PACKET = struct.Struct("<hhh")
_PIECE, _OLD_PIECE = 30_000, 244  # bytes in a sent packet; V-REP 3.1's clients have no larger buffer
_MAX_PACKETS = 2**15 - 1  # of a message
# Checksum (V-REP 3.1 only), version, number, client's time, server's time, scene, state.
_HEADER = struct.Struct("<HBiiiHB")
_COMMAND = struct.Struct("<iiHiiHiBB")  # size, total size, key size, shift, code and mode, delay, time, status, 0
_FAILED = 1  # bit of the status
_CODE = 0xFFFF

# Execution modes of a command.
ONESHOT, BLOCKING, STREAMING, ONESHOT_SPLIT, STREAMING_SPLIT, DISCONTINUE = range(6)
_MODES = range(6)

_Key = tuple[int | str, ...]
# The keys of commands: first code with this kind of key, count of numbers, count of strings after them.
_KEYS = ((0x0000, 0, 0), (0x1000, 1, 0), (0x2000, 2, 0), (0x3000, 0, 1), (0x3400, 1, 2), (0x3500, 0, 1))
_KEY_EXCEPTIONS = {0x000A: (1, 0), 0x2003: (1, 0)}  # exceptions: the end of a session, and simxGetUIEventButton


class Command(NamedTuple):
    """A command of a client.

    delay: ms between two replies to a streaming command; raw_key: the key as received; whole: size of all its data in
    bytes, of which `data` begins at offset `shift`.
    """

    code: int
    mode: int
    delay: int
    key: _Key
    raw_key: bytes
    data: bytes
    shift: int = 0
    whole: int = 0


class Message(NamedTuple):
    """A client's message: its number, when it was sent (ms of the client's clock), and its commands."""

    number: int
    sent: int
    commands: list[Command]


class Answer(NamedTuple):
    """The reply to a command; `data` is None if it failed."""

    command: Command
    data: bytes | None


class Stamp(NamedTuple):
    """Part of every reply's header: the server's clock and the simulation's (ms), the scene, and state bits."""

    time: int
    simulated: int
    scene: int
    state: int


class Packets:
    """Joins the packets of a connection into messages, and splits answers into packets that its client can read."""

    def __init__(self) -> None:
        self._is_old = False  # whether the client sends and requires checksums, as up to V-REP 3.1
        self._bytes = bytearray()
        self._at = 0  # offset of the next packet
        self._message = bytearray()
        self._left: int | None = None  # missing packets of an incomplete message

    def add(self, received: bytes) -> None:
        del self._bytes[: self._at]
        self._at = 0
        self._bytes += received

    def take(self) -> bytes | None:
        """Return the next message, None if it is incomplete. Raises ValueError, in one line, for an invalid one."""
        while len(self._bytes) - self._at >= _PACKET.size:
            first, size, left = _PACKET.unpack_from(self._bytes, self._at)
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
        if not self._is_old:
            return packets(answer, _PIECE)
        check_sum = struct.pack("<H", binascii.crc_hqx(answer[2:], 0))
        return packets(check_sum + answer[2:], max(_OLD_PIECE, -(-len(answer) // _MAX_PACKETS)))


def packets(message: bytes, piece: int) -> bytes:
    """Return a message as packets with `piece` bytes of it in each."""
    pieces = [message[start : start + piece] for start in range(0, len(message), piece)]
    left = len(pieces)
    return b"".join(_PACKET.pack(1, len(part), left - count) + part for count, part in enumerate(pieces, 1))


def read(message: bytes) -> Message:
    """Return a decoded message. Raises ValueError, in one line, for an invalid message."""
    if len(message) < _HEADER.size:
        raise ValueError(f"malformed message: {len(message)} bytes, but a header alone has {_HEADER.size}")
    _, _, number, sent, *_ = _HEADER.unpack_from(message)
    commands: list[Command] = []
    for command in _commands(message):
        commands.append(command)
        if len(commands) > _MAX_COMMANDS:
            raise ValueError(f"a message has more than {_MAX_COMMANDS} commands")
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
    """Return a command's decoded key. Raises ValueError if it does not match the command's code."""
    kinds = ((numbers, texts) for first, numbers, texts in reversed(_KEYS) if code >= first)
    count, texts = _KEY_EXCEPTIONS.get(code) or next(kinds)
    size = 4 * count
    *parts, rest = raw[size:].split(b"\0", texts) if texts else [raw[size:]]
    if len(raw) < size or len(parts) != texts or rest:
        raise ValueError(f"malformed payload for command {code:#06x}: a key of {len(raw)} bytes")
    return *struct.unpack_from(f"<{count}i", raw), *(part.decode("utf-8", "replace") for part in parts)


def write(to: Message, answers: Sequence[Answer], stamp: Stamp) -> bytes:
    """Return the reply to a message."""
    parts = [_HEADER.pack(0, VERSION, to.number, to.sent, stamp.time, stamp.scene, stamp.state)]
    for command, data in answers:
        key = command.raw_key
        size = _COMMAND.size + len(key) + len(data or b"")
        code = command.code | command.mode << 16
        status = _FAILED if data is None else 0
        parts.append(_COMMAND.pack(size, size, len(key), 0, code, command.delay, stamp.simulated, status, 0))
        parts += key, data or b""
    return b"".join(parts)
