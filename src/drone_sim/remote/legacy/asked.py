"""One command of a client's, and what it may do to carry it out."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drone_sim.remote.client import one_line
from drone_sim.remote.legacy.wire import Command
from drone_sim.scripting.api.calls import Function


class Refused(Exception):
    """A command cannot be carried out: one line that says why, '' where that is nothing to speak of."""


class Reach(NamedTuple):
    """What the commands of a client reach: the script API's functions by name, such as sim.getObject, and a selection.

    The selection is what clients have selected, and no more than a list.
    """

    functions: Mapping[str, Function]
    selected: list[int]


class Asked:
    """A command; handlers read `key` and data, and call functions of the script API."""

    def __init__(self, name: str, command: Command, reach: Reach):
        """`name` is the client's function, such as simxGetObjectHandle."""
        self.name = name
        self.key: Any = command.key
        self.data = command.data
        self.reach = reach

    def sim(self, function: str, *arguments: Any) -> Any:
        """Call a function of `sim`. Raises Refused."""
        called = self.reach.functions[f"sim.{function}"]
        try:
            return called(*arguments)
        except Exception as error:
            raise Refused(one_line(self.name, called, arguments, error)) from error

    def take(self, layout: str) -> tuple[Any, ...]:
        """Return the numbers in the data, such as "3f". Raises Refused where they are not so many."""
        try:
            return struct.unpack(f"<{layout}", self.data)
        except struct.error:
            size = struct.calcsize(f"<{layout}")
            raise self.refused(f"has {len(self.data)} bytes of data, must have {size}") from None

    def handles(self) -> list[int]:
        """Return the whole numbers in the data. Raises Refused where it ends within one."""
        return list(self.take(f"{len(self.data) // 4}i"))

    def refused(self, why: str) -> Refused:
        """Return what to raise."""
        return Refused(f"{self.name}: {why}")


# Returns what the client reads; None where there is nothing to answer yet.
Handler = Callable[[Asked], bytes | None]


class Served(NamedTuple):
    """A function of the client's, and what carries it out."""

    name: str
    do: Handler


Table = dict[int, Served]  # by the codes of commands


def nothing(_returned: Any) -> bytes:
    """Return what a client reads of a function that returns nothing to it."""
    return b""
