"""Connection of the simulation to a script's process."""

from __future__ import annotations

import marshal
import socket
from collections import deque
from collections.abc import Callable
from time import monotonic
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.rpc import values
from drone_sim.scripting.rpc.channel import Channel

_CHECK_INTERVAL = 0.5  # s between checks of the deadline, while no message arrives
Permit = Callable[[str, list[Any]], Callable[[Any], None] | None]


def _all_permitted(_function: str, _arguments: list[Any]) -> None:
    pass


class ScriptConnection:
    """The simulation's end of the RPC: sends commands to a script's process and receives its requests."""

    def __init__(self, end: socket.socket, processor: int | None = None):
        """Use the socket `end`.

        `processor`: the CPU core of this process, None for any. The script's process uses it, too: only one of the two
        works at a time, and a message to another core takes ten times as long.
        """
        self._channel = Channel(end, _CHECK_INTERVAL)
        self.processor = processor
        self.permit: Permit = _all_permitted
        self.items: deque[list[Any]] = deque()  # received and not yet handled
        self._numbers = 0
        self.why_closed = ""  # a line of text; '' while open
        self.is_gone = False  # whether the script's process has ended or does not receive
        self.objects: ObjectTree | None = None
        self.is_quiet: Callable[[], bool] = lambda: False

    def begin(self, objects: ObjectTree, is_quiet: Callable[[], bool], permit: Permit | None = None) -> None:
        """Set the objects of a flight, before its scripts are loaded.

        `permit` is called with a function's name and arguments before each call. It raises ValueError if the script may
        not make the call; it may return a function that is called with the result.
        `is_quiet` returns whether a script receives nothing between the coming sensing and the next actuation: then it
        may run that actuation right after the sensing.
        """
        self.objects, self.is_quiet = objects, is_quiet
        self.permit = permit or _all_permitted

    def new_number(self) -> int:
        """Return a number that identifies another script in the script's process."""
        self._numbers += 1
        return self._numbers

    def close(self, why: str) -> None:
        """Close the channel; later calls fail with `why`."""
        self.why_closed = self.why_closed or why
        self._channel.close()

    def send(self, message: tuple[Any, ...]) -> None:
        """Send a message. Raises Disconnected."""
        self._channel.send(marshal.dumps(message))

    def next_item(self, deadline: float) -> list[Any]:
        """Return the next item. Raises InvalidMessage, Disconnected, and TimeoutError after `deadline`."""
        while not self.items:
            if monotonic() > deadline:
                raise TimeoutError
            message = self._channel.receive()
            if message is not None:
                self.items.extend(values.read(message))
        return self.items.popleft()
