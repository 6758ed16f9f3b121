"""From the bytes that a terminal sends to keys, the command that they change, and which one is in force.

Neither a terminal nor ROS is needed.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

UP, DOWN, LEFT, RIGHT, ENTER, BACKSPACE = "up", "down", "left", "right", "enter", "backspace"
ESCAPE, UNKNOWN = "escape", "unknown"
KEY_PATIENCE = 0.5  # s, for what may follow an ESC; a slow line sends a sequence in pieces

# ECMA-48: ESC [ parameters final, or ESC O final. The Linux console adds ESC [ [ final, and Alt an ESC before a key.
_WHOLE = re.compile(rb"\x1b+(?:\[\[.|\[[0-?]*[ -/]*[@-Z\\-~]|O[0-9;]*[@-~]|[^\x1b\[O])", re.DOTALL)
_BEGINNING = re.compile(rb"\x1b+(?:\[\[?|\[[0-?]*[ -/]*|O[0-9;]*)?")
_ARROW = re.compile(rb"\x1b+[\[O][0-9;]*([ABCD])")
_ARROWS = {b"A": UP, b"B": DOWN, b"C": RIGHT, b"D": LEFT}
_CHARACTER = re.compile(rb"[\xc0-\xff][\x80-\xbf]*|.", re.DOTALL)  # UTF-8
_PLAIN = {b"\x7f": BACKSPACE, b"\x08": BACKSPACE, b"\r": ENTER, b"\n": ENTER}
_STEP = 0.1  # m/s, per key press
_TURN_STEP = 0.2  # rad/s, per key press
_FAST = 2.5  # times, of a capital letter
_PATIENCE = 0.5  # s, until what was sent should be in force


class KeyDecoder:
    """Takes bytes as they come, in pieces of any size, and tells the keys: a character, or one of the names above."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """Take a monotonic clock."""
        self._clock = clock
        self.clear()

    def clear(self) -> None:
        """Forget what has begun."""
        self._bytes = b""
        self._came = self._clock()

    def feed(self, data: bytes) -> list[str]:
        """Return the keys that are complete with `data`, which may be empty; call it at least now and then.

        An ESC after which nothing comes for KEY_PATIENCE is the key itself; another beginning of a sequence is dropped.
        """
        keys = []
        if data:
            self._bytes += data
            self._came = self._clock()
        while self._bytes and not _BEGINNING.fullmatch(self._bytes):
            keys.append(self._take())
        if self._bytes and self._clock() - self._came >= KEY_PATIENCE:
            keys.append(UNKNOWN if self._bytes.strip(b"\x1b") else ESCAPE)
            self._bytes = b""
        return keys

    def _take(self) -> str:
        found = _WHOLE.match(self._bytes) or _BEGINNING.match(self._bytes) or _CHARACTER.match(self._bytes)
        assert found
        taken, self._bytes = found.group(), self._bytes[found.end() :]
        if taken.startswith(b"\x1b"):
            arrow = _ARROW.fullmatch(taken)
            return _ARROWS[arrow.group(1)] if arrow else UNKNOWN
        if taken in _PLAIN:
            return _PLAIN[taken]
        return taken.decode() if taken.isascii() and taken.decode().isprintable() else UNKNOWN


class Command(NamedTuple):
    """Speeds forward, left and up (m/s), and turning left (rad/s)."""

    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    wz: float = 0.0

    def after(self, key: str, keys: Mapping[str, Command]) -> Command | None:
        """Return the command after a key press of a map, or None for a key that commands nothing.

        A capital letter, as with Shift, changes it by more.
        """
        if key == " ":
            return Command()
        change = keys.get(key) or keys.get(key.lower())
        if change is None:
            return None
        times = 1.0 if key in keys else _FAST
        return Command(*(old + times * more for old, more in zip(self, change))).rounded()

    def rounded(self) -> Command:
        """Return it without the last digits, that sums of steps have wrong."""
        return Command(*(round(value, 6) for value in self))

    def __str__(self) -> str:
        """Return it with its units."""
        return "vx {:+.2f}  vy {:+.2f}  vz {:+.2f} m/s   wz {:+.2f} rad/s".format(*self)


_ARROW_KEYS = {
    UP: Command(vx=_STEP),
    DOWN: Command(vx=-_STEP),
    LEFT: Command(vy=_STEP),
    RIGHT: Command(vy=-_STEP),
}
# What each key changes, by the name of the map: the cockpit's keys, and those of demo_teleop, the course's own node,
# with two more for the height. web/src/teleop.js has the first map once more.
KEY_MAPS: Mapping[str, Mapping[str, Command]] = {
    "cockpit": {
        **_ARROW_KEYS,
        "w": _ARROW_KEYS[UP],
        "s": _ARROW_KEYS[DOWN],
        "a": _ARROW_KEYS[LEFT],
        "d": _ARROW_KEYS[RIGHT],
        "q": Command(wz=_TURN_STEP),
        "e": Command(wz=-_TURN_STEP),
        "r": Command(vz=_STEP),
        "f": Command(vz=-_STEP),
    },
    "course": {
        **_ARROW_KEYS,
        "e": Command(wz=_TURN_STEP),
        "r": Command(wz=-_TURN_STEP),
        "u": Command(vz=_STEP),
        "d": Command(vz=-_STEP),
    },
}


class CommandInForce:
    """What the simulator says is in force, and what was sent and cannot be in force yet. Any thread may call it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """Begin knowing nothing; take a monotonic clock."""
        self._clock = clock
        self._lock = threading.Lock()
        self.forget()

    def forget(self) -> None:
        """Know nothing: the simulator has gone, or another one has come."""
        with self._lock:
            self.heard: Command | None = None
            self.sent = Command()
            self._awaited = False
            self._others = 0
            self._since = self._clock()

    @property
    def next(self) -> Command:
        """The command that a key press changes: that in force, or what was sent a moment ago."""
        with self._lock:
            return self.sent if self._awaited or self.heard is None else self.heard

    def send(self, command: Command) -> None:
        """Say that a command is being sent."""
        with self._lock:
            self.sent, self._awaited = command, True
            self._others, self._since = 0, self._clock()

    def hear(self, command: Command) -> None:
        """Take the command in force.

        A command other than the one sent may be an older one that arrives late; if it stays, another node has sent it.
        """
        with self._lock:
            self.heard = command.rounded()
            self._others += 1
            late = self._others > 1 and self._clock() - self._since > _PATIENCE
            if self.heard == self.sent or late:
                self._awaited = False
