"""A command of a client, with access to the script API to execute it, and the encoding of its reply."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from typing import Any

from drone_sim.remote.client import Client, one_line
from drone_sim.remote.legacy.wire import Command

_MAX_FLOAT = 3.4028234663852886e38  # largest finite single-precision number


class Refused(Exception):
    """A command cannot be executed; the one-line reason, '' if it is not worth reporting."""


class Request:
    """A command; handlers read its key and data, and call functions of the script API."""

    def __init__(self, name: str, command: Command, client: Client, selected: list[int]):
        """`name` is the client's function, such as simxGetObjectHandle; `selected`: handles that clients selected."""
        self.name = name
        self.key: Any = command.key
        self.data = command.data
        self.selected = selected
        self._client = client

    def sim(self, function: str, *arguments: Any) -> Any:
        """Call a function of `sim`. Raises Refused."""
        method = self._client.functions()[f"sim.{function}"]
        try:
            return method(*arguments)
        except Exception as error:
            raise Refused(one_line(self.name, method, arguments, error)) from error

    def take(self, layout: str) -> tuple[Any, ...]:
        """Return the numbers in the data, with a struct layout such as "3f". Raises Refused if the size differs."""
        try:
            return struct.unpack(f"<{layout}", self.data)
        except struct.error:
            size = struct.calcsize(f"<{layout}")
            raise self.refused(f"has {len(self.data)} bytes of data, must have {size}") from None

    def handles(self) -> list[int]:
        """Return the 32-bit integers in the data. Raises Refused if the last one is incomplete."""
        return list(self.take(f"{len(self.data) // 4}i"))

    def refused(self, why: str) -> Refused:
        """Return the exception to raise, with the function's name in front of `why`."""
        return Refused(f"{self.name}: {why}")


def floats(*values: float) -> bytes:
    """Return single-precision numbers; values beyond their range become infinite."""
    layout = f"<{len(values)}f"
    try:
        return struct.pack(layout, *values)
    except OverflowError:
        return struct.pack(layout, *(x if abs(x) <= _MAX_FLOAT else math.copysign(math.inf, x) for x in values))


def vector(values: Iterable[float]) -> bytes:
    """Return the single-precision numbers of a list."""
    return floats(*values)


def ints(*values: float) -> bytes:
    """Return 32-bit integers."""
    return struct.pack(f"<{len(values)}i", *map(int, values))


def counted(values: Iterable[int]) -> bytes:
    """Return the number of integers, and the integers."""
    numbers = list(values)
    return ints(len(numbers), *numbers)


def raw(value: str | bytes) -> bytes:
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
