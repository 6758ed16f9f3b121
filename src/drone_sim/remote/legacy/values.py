"""How values are written that a client reads."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

_LARGEST = 3.4028234663852886e38  # of single precision


def floats(*values: float) -> bytes:
    """Return numbers in single precision; what is too large for that is infinite."""
    layout = f"<{len(values)}f"
    try:
        return struct.pack(layout, *values)
    except OverflowError:
        return struct.pack(layout, *(one if abs(one) <= _LARGEST else math.copysign(math.inf, one) for one in values))


def ints(*values: float) -> bytes:
    """Return whole numbers of 32 bits."""
    return struct.pack(f"<{len(values)}i", *map(int, values))


def counted(values: Iterable[int]) -> bytes:
    """Return how many whole numbers there are, and these."""
    listed = list(values)
    return ints(len(listed), *listed)


def raw(value: str | bytes) -> bytes:
    """Return a string as it is."""
    return value.encode("utf-8", "surrogateescape") if isinstance(value, str) else value


def text(value: str | bytes) -> bytes:
    """Return a string that ends in a zero."""
    return raw(value) + b"\0"


def string(data: bytes) -> str | bytes:
    """Return a string as scripts have it: bytes where it is no UTF-8."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data
