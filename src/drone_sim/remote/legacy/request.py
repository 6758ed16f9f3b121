"""A command of a client, with access to the script API to execute it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drone_sim.remote.client import one_line
from drone_sim.remote.legacy.wire import Command
from drone_sim.scripting.api.calls import Function


class Refused(Exception):
    """A command cannot be executed; the one-line reason, '' if it is not worth reporting."""


class RequestContext(NamedTuple):
    """What a client's commands can access: functions of the script API by name, such as sim.getObject, and a selection.

    The selection is only a list, of the objects that clients have selected.
    """

    functions: Mapping[str, Function]
    selected: list[int]


class Request:
    """A command; handlers read its key and data, and call functions of the script API."""

    def __init__(self, name: str, command: Command, context: RequestContext):
        """`name` is the client's function, such as simxGetObjectHandle."""
        self.name = name
        self.key: Any = command.key
        self.data = command.data
        self.context = context

    def sim(self, function: str, *arguments: Any) -> Any:
        """Call a function of `sim`. Raises Refused."""
        method = self.context.functions[f"sim.{function}"]
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


# Returns the data of the reply; None if there is no reply yet.
HandlerFunction = Callable[[Request], bytes | None]


class Handler(NamedTuple):
    """A function of the client, and its handler."""

    name: str
    do: HandlerFunction


Table = dict[int, Handler]  # by command code


def nothing(_returned: Any) -> bytes:
    """Return the empty reply of a function without a result."""
    return b""
