"""The grammar of V-REP's files: tagged chunks within each other, and the values in them.

A chunk is 3 bytes of tag, an i32 size, and so many bytes. EOO, NXT and EOF have no size: they end a level of an
object. What a tag means depends on where it stands, so that each reader asks for those that it knows; the others are
passed over. Little-endian; a text is an i32 length and its bytes.
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
_MOST_CHUNKS = 1_000_000  # of one level
_LARGEST = 1e30  # of a number: nothing in a scene comes near it


class Chunk(NamedTuple):
    """A tag and what is in it."""

    tag: str
    data: bytes


class Level:
    """The chunks of one level of an object: base or class, wrapper or mesh."""

    def __init__(self) -> None:
        """Begin with none."""
        self.chunks: list[Chunk] = []

    def find(self, *tags: str) -> bytes | None:
        """Return what is in the first chunk that has one of these tags, the first tag before the others."""
        return next((one.data for tag in tags for one in self.chunks if one.tag == tag), None)

    def integers(self, *tags: str, count: int = 1, kind: str = "i") -> tuple[int, ...] | None:
        """Return that many integers, or None; raises VrepFileError where there are fewer. `kind` is struct's."""
        data = self.find(*tags)
        return None if data is None else unpack(f"<{count}{kind}", data, tags[0])

    def integer(self, *tags: str, default: int = 0, kind: str = "i") -> int:
        """Return the first integer of a chunk; raises VrepFileError where it is cut."""
        found = self.integers(*tags, kind=kind)
        return default if found is None else found[0]

    def bits(self, *tags: str, default: int = 0) -> int:
        """Return the byte that holds switches."""
        return self.integer(*tags, default=default, kind="B")

    def numbers(self, double: str, single: str, count: int) -> tuple[float, ...] | None:
        """Return that many numbers: doubles where their tag is there, otherwise floats; None where neither is.

        Raises VrepFileError where there are fewer, or one is not finite.
        """
        found = self.unchecked(double, single, count)
        return None if found is None else finite(found, single)

    def unchecked(self, double: str, single: str, count: int) -> tuple[float, ...] | None:
        """Return what `numbers` does, whatever the numbers are. Raises VrepFileError where there are fewer."""
        data = self.find(double)
        if data is not None:
            return unpack(f"<{count}d", data, double)
        data = self.find(single)
        return None if data is None else singles(f"<{count}f", data, single)

    def text(self, tag: str) -> str:
        """Return a text, '' where there is none. Raises VrepFileError."""
        data = self.find(tag)
        return "" if data is None else Texts(data, tag).text()


class Texts:
    """Reads texts and integers that follow each other."""

    def __init__(self, data: bytes, tag: str):
        """Take them, and the tag that a message names."""
        self._data = data
        self._tag = tag
        self._at = 0

    def integer(self) -> int:
        """Return the integer that comes next. Raises VrepFileError."""
        value: int = unpack("<i", self._data[self._at : self._at + 4], self._tag)[0]
        self._at += 4
        return value

    def bytes(self) -> bytes:
        """Return the bytes that come next. Raises VrepFileError."""
        length = self.integer()
        if not 0 <= length <= len(self._data) - self._at:
            raise VrepFileError(f"{self._tag}: a text of {length} bytes does not fit into the chunk")
        self._at += length
        return self._data[self._at - length : self._at]

    def text(self) -> str:
        """Return the text that comes next. Raises VrepFileError."""
        return decoded(self.bytes())


def decoded(text: bytes) -> str:
    """Return a text of a file: UTF-8, or Latin-1 as old ones have it."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def unpack(form: str, data: bytes, tag: str) -> tuple:
    """Return the values at the beginning of a chunk, by struct's format. Raises VrepFileError where it is shorter."""
    try:
        return struct.unpack_from(form, data)
    except struct.error:
        need = struct.calcsize(form)
        raise VrepFileError(f"{tag}: {len(data)} bytes where {need} are needed") from None


def singles(form: str, data: bytes, tag: str) -> tuple[float, ...]:
    """Return what `unpack` does, each float32 as the shortest decimal that stands for it: 0.1, not 0.10000000149."""
    return tuple(float(str(np.float32(value))) for value in unpack(form, data, tag))


def finite(values: tuple[float, ...], tag: str) -> tuple[float, ...]:
    """Return the numbers. Raises VrepFileError for one that is not finite, or is absurd."""
    for value in values:
        if not abs(value) < _LARGEST:  # nor a NaN
            raise VrepFileError(f"{tag}: the number {value} makes no sense here")
    return values


def levels(data: bytes, most: int) -> list[Level]:
    """Return an object's levels: at least one, at most `most`. Raises VrepFileError."""
    found = [Level()]
    for one in _chunks(data):
        if one is None:
            found.append(Level())
        else:
            found[-1].chunks.append(one)
    while len(found) > 1 and not found[-1].chunks:
        found.pop()
    if len(found) > most:
        raise VrepFileError(f"has {len(found)} levels; at most {most} are known")
    return found


def level(data: bytes) -> Level:
    """Return an object of one level. Raises VrepFileError."""
    return levels(data, 1)[0]


def top(payload: bytes) -> Iterator[Chunk]:
    """Yield the chunks of a whole file. Raises VrepFileError."""
    for one in _chunks(payload, must_end=True):
        if one is not None:
            yield one


def _chunks(data: bytes, must_end: bool = False) -> Iterator[Chunk | None]:
    """Yield the chunks, None at the end of every level."""
    at, size = 0, len(data)
    for _ in range(_MOST_CHUNKS):
        if at == size:
            if must_end:
                raise VrepFileError("is cut off: its last chunk, EOF, is missing")
            return
        tag = data[at : at + 3]
        at += 3
        if tag in _MARKERS:
            if tag == _END:
                return
            yield None
            continue
        length = unpack("<i", data[at : at + 4], _shown(tag))[0]
        at += 4
        if not 0 <= length <= size - at:
            raise VrepFileError(f"{_shown(tag)}: a chunk of {length} bytes does not fit into the {size - at} left")
        yield Chunk(tag.decode("latin-1"), data[at : at + length])
        at += length
    raise VrepFileError(f"holds more than {_MOST_CHUNKS} chunks on one level")


def _shown(tag: bytes) -> str:
    text = tag.decode("latin-1")
    return text if text.isprintable() and text else repr(tag)


def quaternion_first(seven: tuple[float, ...] | None, tag: str) -> Pose:
    """Return an object's pose: w, x, y, z of a quaternion, then a position; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if seven is None else _pose(seven[4:7], seven[:4], tag)


def position_first(seven: tuple[float, ...] | None, tag: str) -> Pose:
    """Return a mesh's pose: a position, then w, x, y, z of a quaternion; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if seven is None else _pose(seven[:3], seven[3:7], tag)


def _pose(position: tuple[float, ...], quaternion: tuple[float, ...], tag: str) -> Pose:
    length = math.sqrt(sum(value * value for value in quaternion))
    if not 0.9 < length < 1.1:
        raise VrepFileError(f"{tag}: its quaternion has the length {length:.3g}, not 1")
    w, x, y, z = (value / length for value in quaternion)
    return Pose((position[0], position[1], position[2]), (x, y, z, w))
