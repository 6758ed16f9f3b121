"""Keys held in a browser, as commands: while they are held, and while the browser says so."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.ros.tools.commands import Command

_PERIOD = 0.1  # s between two commands while keys are held
_SILENCE = 1.5  # s without a word from a browser after which its keys are released
_FASTEST = 20.0  # m/s, rad/s; more is no speed that a page of ours asks for


class Flying:
    """Who flies: the browsers' commands, of which the one that changed last counts. Any thread may call it."""

    def __init__(self, send: Callable[[Command], None], clock: Callable[[], float] = time.monotonic):
        """Take what sends a command to the vehicle; `clock` returns s."""
        self._send = send
        self._clock = clock
        self._lock = threading.Lock()
        self._held: dict[int, tuple[Command, float]] = {}  # command, and when it was last said, by browser
        self._sent = Command()

    def hold(self, browser: int, command: Command) -> None:
        """Take what a browser's keys ask for now; it says so again while it holds them."""
        with self._lock:
            before = self._held.pop(browser, (Command(), 0.0))[0]
            if command != Command():
                self._held[browser] = command, self._clock()
            if command != before:
                self._tell()

    def gone(self, browser: int) -> None:
        """Release the keys of a browser that has closed its connection."""
        self.hold(browser, Command())

    def look(self) -> None:
        """Repeat the command in force, and release the keys of browsers that have fallen silent."""
        with self._lock:
            now = self._clock()
            silent = [one for one, (_, said) in self._held.items() if now - said > _SILENCE]
            for browser in silent:
                del self._held[browser]
            if self._held or silent:
                self._tell()

    def _tell(self) -> None:
        command = next(reversed(self._held.values()))[0] if self._held else Command()
        if command != Command() or self._sent != Command():
            self._sent = command
            self._send(command)

    def watch(self, going: Callable[[], bool]) -> None:
        """Look again and again, as long as `going` says so."""
        while going():
            time.sleep(_PERIOD)
            self.look()


def read_command(given: Any) -> Command:
    """Return the command in a browser's message: vx, vy, vz (m/s), wz (rad/s). Raises ValueError."""
    if not isinstance(given, Mapping) or not set(given) <= set(Command._fields):
        raise ValueError(f"hold: must be a mapping of {', '.join(Command._fields)}")
    for name, value in given.items():
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not abs(value) <= _FASTEST:
            raise ValueError(f"hold/{name}: must be a number from -{_FASTEST:g} to {_FASTEST:g}")
    return Command(**{name: float(value) for name, value in given.items()})
