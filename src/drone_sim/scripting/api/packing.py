"""`sim`: packing of values into strings for signals and custom data, and bit operations."""

from __future__ import annotations

import copy
import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.types import Numbers, Text, WrongValue, refuse_if_too_large

# Types of numbers: the name in 4.x, the name in 3.x, and the format for struct.
_KINDS = {
    "FloatTable": ("Floats", "f"),
    "DoubleTable": ("Doubles", "d"),
    "Int32Table": ("Ints", "i"),
    "UInt32Table": ("UInts", "I"),
    "UInt16Table": ("Words", "H"),
    "UInt8Table": ("Bytes", "B"),
}
_FORMATS = {0: "B", 1: "b", 2: "H", 3: "h", 4: "I", 5: "i", 6: "f", 7: "d"}  # by sim.buffer_...
_MASK = 0xFFFFFFFF


class Packing:
    """Values packed into strings for signals and custom data, little endian."""

    @sim("345")
    def packTable(self, table: Any, _scheme: int = 0) -> bytes:
        """Return a table of numbers, strings, booleans and tables as a string for unpackTable."""
        refuse_if_too_large(table)
        return json.dumps(_plain(table)).encode()

    @sim("345")
    def unpackTable(self, data: Text) -> Any:
        """Return the table in a string from packTable."""
        try:
            return _table(json.loads(as_bytes(data)))
        except (ValueError, TypeError, LookupError, RecursionError):
            raise ValueError("this string was not made by sim.packTable") from None

    @sim("345")
    def transformBuffer(self, data: Text, from_kind: int, factor: float, offset: float, to_kind: int) -> bytes:
        """Convert values from one sim.buffer_... type to another, each multiplied by `factor`, plus `offset`."""
        if from_kind not in _FORMATS or to_kind not in _FORMATS:
            raise ValueError("known are sim.buffer_uint8, _int8, _uint16, _int16, _uint32, _int32, _float and _double")
        values = [factor * value + offset for value in _unpacked(_FORMATS[from_kind], as_bytes(data))]
        return _packed(_FORMATS[to_kind], values)


def _add_kind(code: str, new: str, old: str) -> None:
    """Add the functions for one type of number."""

    def pack(_self: Packing, values: Numbers, start: int = 0, count: int = 0) -> bytes:
        return _packed(code, _part(values, start, count))

    def unpack(_self: Packing, data: Text, start: int = 0, count: int = 0, offset: int = 0) -> list[float]:
        if not offset >= 0:
            raise WrongValue("the offset must be 0 bytes or more")
        return _part(_unpacked(code, as_bytes(data)[int(offset) :]), start, count)

    part = f"a string of {struct.calcsize(code)} bytes each, `count` (0: all) from `start`."
    sim.add(Packing, pack, f"pack{new}", f"Return numbers as {part}", **{f"pack{old}": "3"})
    sim.add(Packing, unpack, f"unpack{new}", f"Return the numbers in {part}", **{f"unpack{old}": "3"})


for _new, (_old, _code) in _KINDS.items():
    _add_kind(_code, _new, _old)


def _part(values: Sequence[Any], start: int, count: int) -> list[Any]:
    if not (start >= 0 and count >= 0):
        raise WrongValue("start and count must be 0 or more")
    first = int(start)
    return list(values[first : first + int(count)] if count else values[first:])


def _packed(kind: str, values: Sequence[Any]) -> bytes:
    """Return values as bytes. Raises WrongValue if a value is not a number, ValueError if it is too large."""
    try:
        numbers = [float(value) if kind in "fd" else int(value) for value in values]
    except (TypeError, ValueError, OverflowError):
        raise WrongValue("expected a table of numbers") from None
    try:
        return struct.pack(f"<{len(numbers)}{kind}", *numbers)
    except (struct.error, OverflowError) as error:
        raise ValueError(f"a number is too large for this type: {error}") from None


def _unpacked(kind: str, data: bytes) -> list[Any]:
    count = len(data) // struct.calcsize(kind)
    return list(struct.unpack_from(f"<{count}{kind}", data))


def as_bytes(data: Text | bytes) -> bytes:
    """Return a script's string as bytes. Raises WrongValue for other values."""
    if isinstance(data, str):
        return data.encode("utf-8", "surrogateescape")
    if not isinstance(data, (bytes, bytearray)):
        raise WrongValue("expected a string")
    return bytes(data)


def _plain(value: Any) -> Any:
    """Return a value encoded for JSON. Raises WrongValue if it cannot be packed."""
    if isinstance(value, Mapping):
        return {"table": [[_plain(key), _plain(item)] for key, item in value.items()]}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (bytes, bytearray)):
        return {"bytes": value.decode("latin-1")}
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise WrongValue(f"a {type(value).__name__} cannot be packed")


def _table(value: Any) -> Any:
    if isinstance(value, list):
        return [_table(item) for item in value]
    if isinstance(value, dict):
        if "bytes" in value:
            return value["bytes"].encode("latin-1")
        return {_table(key): _table(item) for key, item in value["table"]}
    return value


class Tables:
    """Tables of a script."""

    @sim("45")
    def copyTable(self, table: Any) -> Any:
        """Return a deep copy of a table; other values are returned unchanged."""
        return copy.deepcopy(table)


class Bits:
    """Bit operations on whole numbers, for which Lua 5.1 has no operators."""

    @sim("345", boolOr16="345")
    def boolOr32(self, first: int, second: int) -> int:
        """Return the bitwise or of two numbers."""
        return _whole(first) | _whole(second)

    @sim("345", boolAnd16="345")
    def boolAnd32(self, first: int, second: int) -> int:
        """Return the bitwise and of two numbers."""
        return _whole(first) & _whole(second)

    @sim("345", boolXor16="345")
    def boolXor32(self, first: int, second: int) -> int:
        """Return the bitwise exclusive or of two numbers."""
        return _whole(first) ^ _whole(second)


def _whole(value: float) -> int:
    if not isinstance(value, (int, float)) or value != value // 1 or abs(value) > _MASK:
        raise WrongValue("expected whole numbers of 32 bits")
    return int(value) & _MASK
