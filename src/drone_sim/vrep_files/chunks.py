"""The chunk format of V-REP's files: nested tagged chunks, and the values in them.

A chunk is a tag of 3 bytes, an i32 size, and `size` bytes of data. EOO, NXT and EOF have no size: they end a level of
an object. The meaning of a tag depends on its parent, so each reader looks up the tags that it knows; other chunks are
skipped. All values are little-endian; a text is an i32 length and its bytes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics.state import Pose
from drone_sim.vrep_files.model import ORIGIN, VrepFileError

_MARKERS = (b"EOO", b"NXT", b"EOF")
_END = b"EOF"
_MAX_CHUNKS = 1_000_000  # of an object
_MAX_NUMBER = 1e30  # far above any number in a real scene


class Chunk(NamedTuple):
    """A tag and its data."""

    tag: str
    data: bytes


class Level:
    """The chunks of one level of an object, e.g. of its base class, its class, a wrapper or a mesh."""

    def __init__(self) -> None:
        self.chunks: list[Chunk] = []

    def find(self, *tags: str) -> bytes | None:
        """Return the data of the first chunk with one of these tags; earlier tags take precedence."""
        return next((chunk.data for tag in tags for chunk in self.chunks if chunk.tag == tag), None)

    def integers(self, *tags: str, count: int = 1, kind: str = "i") -> tuple[int, ...] | None:
        """Return `count` integers (struct format `kind`), or None. Raises VrepFileError if the chunk is too short."""
        data = self.find(*tags)
        return None if data is None else unpack(f"<{count}{kind}", data, tags[0])

    def integer(self, *tags: str, default: int = 0, kind: str = "i") -> int:
        """Return the first integer of a chunk, or `default` without the chunk. Raises VrepFileError if too short."""
        integers = self.integers(*tags, kind=kind)
        return default if integers is None else integers[0]

    def bits(self, *tags: str, default: int = 0) -> int:
        return self.integer(*tags, default=default, kind="B")

    def numbers(self, double: str, single: str, count: int) -> tuple[float, ...] | None:
        """Return `count` numbers from the chunk of doubles or, without it, from that of floats; None without both.

        Raises VrepFileError if the chunk is too short or a number is not finite.
        """
        numbers = self.unchecked(double, single, count)
        return None if numbers is None else finite(numbers, single)

    def unchecked(self, double: str, single: str, count: int) -> tuple[float, ...] | None:
        """Return the same as `numbers`, but allow numbers that are not finite."""
        data = self.find(double)
        if data is not None:
            return unpack(f"<{count}d", data, double)
        data = self.find(single)
        return None if data is None else singles(f"<{count}f", data, single)

    def text(self, tag: str) -> str:
        """Return a text, '' without the chunk. Raises VrepFileError."""
        data = self.find(tag)
        return "" if data is None else Texts(data, tag).text()


class Texts:
    """Reads consecutive texts and integers."""

    def __init__(self, data: bytes, tag: str):
        """`tag` is named in error messages."""
        self._data = data
        self._tag = tag
        self._position = 0

    def integer(self) -> int:
        """Return the next integer. Raises VrepFileError."""
        value: int = unpack("<i", self._data[self._position : self._position + 4], self._tag)[0]
        self._position += 4
        return value

    def bytes(self) -> bytes:
        """Return the next bytes, stored after their length. Raises VrepFileError."""
        length = self.integer()
        if not 0 <= length <= len(self._data) - self._position:
            raise VrepFileError(f"{self._tag}: a text of {length} bytes does not fit")
        self._position += length
        return self._data[self._position - length : self._position]

    def text(self) -> str:
        """Return the next text. Raises VrepFileError."""
        return decoded(self.bytes())


def decoded(text: bytes) -> str:
    """Decode a text: UTF-8, or Latin-1 as in old files."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def unpack(form: str, data: bytes, tag: str) -> tuple:
    """Unpack the beginning of a chunk with a struct format. Raises VrepFileError if the chunk is too short."""
    try:
        return struct.unpack_from(form, data)
    except struct.error:
        need = struct.calcsize(form)
        raise VrepFileError(f"{tag}: has {len(data)} bytes; {need} are needed") from None


def singles(form: str, data: bytes, tag: str) -> tuple[float, ...]:
    """Unpack float32 numbers, each as its shortest decimal: 0.1, not 0.10000000149."""
    return tuple(float(str(np.float32(value))) for value in unpack(form, data, tag))


def finite(values: tuple[float, ...], tag: str) -> tuple[float, ...]:
    """Return `values`. Raises VrepFileError if one is not finite or larger than `_MAX_NUMBER`."""
    for value in values:
        if not abs(value) < _MAX_NUMBER:  # also false for NaN
            raise VrepFileError(f"{tag}: the number {value} is not finite or absurdly large")
    return values


def levels(data: bytes, most: int) -> list[Level]:
    """Return the levels of an object, 1 to `most`. Raises VrepFileError."""
    result = [Level()]
    for chunk in _chunks(data):
        if chunk is None:
            result.append(Level())
        else:
            result[-1].chunks.append(chunk)
    while len(result) > 1 and not result[-1].chunks:
        result.pop()
    if len(result) > most:
        raise VrepFileError(f"has {len(result)} levels; at most {most} are allowed")
    return result


def level(data: bytes) -> Level:
    """Return the single level of an object. Raises VrepFileError."""
    return levels(data, 1)[0]


def top(payload: bytes) -> Iterator[Chunk]:
    """Yield the top-level chunks of a file. Raises VrepFileError."""
    for chunk in _chunks(payload, must_end=True):
        if chunk is not None:
            yield chunk


def _chunks(data: bytes, must_end: bool = False) -> Iterator[Chunk | None]:
    """Yield the chunks, and None at the end of each level."""
    at, size = 0, len(data)
    for _ in range(_MAX_CHUNKS):
        if at == size:
            if must_end:
                raise VrepFileError("is truncated: it has no EOF")
            return
        tag = data[at : at + 3]
        at += 3
        if tag in _MARKERS:
            if tag == _END:
                return
            yield None
            continue
        length = unpack("<i", data[at : at + 4], _printable(tag))[0]
        at += 4
        if not 0 <= length <= size - at:
            raise VrepFileError(f"{_printable(tag)}: a chunk of {length} bytes does not fit into the {size - at} left")
        yield Chunk(tag.decode("latin-1"), data[at : at + length])
        at += length
    raise VrepFileError(f"has more than {_MAX_CHUNKS} chunks in one object")


def _printable(tag: bytes) -> str:
    text = tag.decode("latin-1")
    return text if text.isprintable() and text else repr(tag)


def quaternion_first(values: tuple[float, ...] | None, tag: str) -> Pose:
    """Return a pose stored as quaternion w, x, y, z and position; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if values is None else _pose(values[4:7], values[:4], tag)


def position_first(values: tuple[float, ...] | None, tag: str) -> Pose:
    """Return a pose stored as position and quaternion w, x, y, z; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if values is None else _pose(values[:3], values[3:7], tag)


def _pose(position: tuple[float, ...], quaternion: tuple[float, ...], tag: str) -> Pose:
    length = math.sqrt(sum(value * value for value in quaternion))
    if not 0.9 < length < 1.1:
        raise VrepFileError(f"{tag}: the quaternion has the length {length:.3g}; it must be 1")
    w, x, y, z = (value / length for value in quaternion)
    return Pose((position[0], position[1], position[2]), (x, y, z, w))
