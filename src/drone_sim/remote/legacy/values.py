"""Binary encoding of values for clients."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

_MAX_FLOAT = 3.4028234663852886e38  # largest finite single-precision number


def floats(*values: float) -> bytes:
    """Return single-precision numbers; values beyond their range become infinite."""
    layout = f"<{len(values)}f"
    try:
        return struct.pack(layout, *values)
    except OverflowError:
        return struct.pack(layout, *(x if abs(x) <= _MAX_FLOAT else math.copysign(math.inf, x) for x in values))


def ints(*values: float) -> bytes:
    """Return 32-bit integers."""
    return struct.pack(f"<{len(values)}i", *map(int, values))


def counted(values: Iterable[int]) -> bytes:
    """Return the number of integers, and the integers."""
    numbers = list(values)
    return ints(len(numbers), *numbers)


def raw(value: str | bytes) -> bytes:
    """Return a string's bytes."""
    return value.encode("utf-8", "surrogateescape") if isinstance(value, str) else value


def text(value: str | bytes) -> bytes:
    """Return a zero-terminated string."""
    return raw(value) + b"\0"


def string(data: bytes) -> str | bytes:
    """Return a string as scripts represent it: bytes if it is not valid UTF-8."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data
