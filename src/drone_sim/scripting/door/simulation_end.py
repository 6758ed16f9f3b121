"""The simulation's end of the door: scripts are loaded through it, and what they send comes out of it."""

from __future__ import annotations

import marshal
import socket
from collections import deque
from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.door import values
from drone_sim.scripting.door.channel import Channel
from drone_sim.scripting.door.script_there import ScriptThere
from drone_sim.scripting.time_limit import TimeLimit

_LOOK = 0.5  # s between two looks at the clock, while nothing comes
Permit = Callable[[str, list[Any]], Callable[[Any], None] | None]


def _all_permitted(_function: str, _arguments: list[Any]) -> None:
    pass


class SimulationEnd:
    """The door, seen from the simulation; scripts of one file are loaded through it."""

    def __init__(self, end: socket.socket, processor: int | None = None):
        """Take an end of the connection.

        `processor` is the one on which this process runs; the script's process runs there, too: only one of the two
        works at a time, and a message to another processor takes ten times as long.
        """
        self._channel = Channel(end, _LOOK)
        self.processor = processor
        self.permit: Permit = _all_permitted
        self.items: deque[list[Any]] = deque()  # that have come, and are not carried out
        self._numbers = 0
        self.why_closed = ""  # in one line; '' while it is open
        self.is_gone = False  # whether the script's process has ended, or hears nothing
        self.objects: ObjectTree | None = None
        self.is_quiet: Callable[[], bool] = lambda: False

    def begin(self, objects: ObjectTree, is_quiet: Callable[[], bool], permit: Permit | None = None) -> None:
        """Take the objects of a flight, before its scripts are loaded.

        `permit` gets the name of a function and what it is called with. It raises ValueError for a call that a script
        may not make; it may return a function that is to be called with the result.

        `is_quiet` tells whether a script will receive nothing between the sensing that is due and the next actuation:
        then it may run that actuation right after the sensing.
        """
        self.objects, self.is_quiet = objects, is_quiet
        self.permit = permit or _all_permitted

    def load(self, path: str, modules: Mapping[str, Api], limit: TimeLimit, turns: Turns | None = None) -> ScriptThere:
        """Load the script there, with the `modules` of its API here; what load.load takes. Raises ScriptError."""
        self._numbers += 1
        script = ScriptThere(self, self._numbers, path, modules, limit)
        script.load()
        return script

    def close(self, why: str) -> None:
        """Let nobody through any more."""
        self.why_closed = self.why_closed or why
        self._channel.close()

    def send(self, message: tuple[Any, ...]) -> None:
        """Send a message. Raises Disconnected."""
        self._channel.send(marshal.dumps(message))

    def next_item(self, deadline: float) -> list[Any]:
        """Return what comes next. Raises NoMessage, Disconnected, and TimeoutError where nothing has by then."""
        while not self.items:
            if monotonic() > deadline:
                raise TimeoutError
            message = self._channel.receive()
            if message is not None:
                self.items.extend(values.read(message))
        return self.items.popleft()
