"""Keys decoded from a terminal's bytes, and the velocity commands that they change. Needs no terminal and no ROS."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

UP, DOWN, LEFT, RIGHT, ENTER, BACKSPACE = "up", "down", "left", "right", "enter", "backspace"
ESCAPE, UNKNOWN = "escape", "unknown"
KEY_PATIENCE = 0.5  # s, to wait after an ESC; a slow connection sends an escape sequence in pieces

# ECMA-48: ESC [ parameters final, or ESC O final. The Linux console adds ESC [ [ final, and Alt an ESC before a key.
_SEQUENCE = re.compile(rb"\x1b+(?:\[\[.|\[[0-?]*[ -/]*[@-Z\\-~]|O[0-9;]*[@-~]|[^\x1b\[O])", re.DOTALL)
_PREFIX = re.compile(rb"\x1b+(?:\[\[?|\[[0-?]*[ -/]*|O[0-9;]*)?")
_ARROW = re.compile(rb"\x1b+[\[O][0-9;]*([ABCD])")
_ARROWS = {b"A": UP, b"B": DOWN, b"C": RIGHT, b"D": LEFT}
_CHARACTER = re.compile(rb"[\xc0-\xff][\x80-\xbf]*|.", re.DOTALL)  # UTF-8
_PLAIN = {b"\x7f": BACKSPACE, b"\x08": BACKSPACE, b"\r": ENTER, b"\n": ENTER}
_STEP = 0.1  # m/s, per key press
_TURN_STEP = 0.2  # rad/s, per key press
_CAPITAL_FACTOR = 2.5  # of the steps of a capital letter
_COMMAND_TIMEOUT = 0.5  # s, until a sent command should be in force


class KeyDecoder:
    """Decodes a stream of bytes to keys: printable characters, and the names above for other keys."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """`clock` must be monotonic (s)."""
        self._clock = clock
        self._bytes = b""
        self._received_at = clock()

    def feed(self, data: bytes) -> list[str]:
        """Return the keys that are complete with `data`. Call this regularly, with b"" if nothing has come.

        An ESC that is followed by nothing for KEY_PATIENCE is the Escape key; another incomplete sequence is UNKNOWN.
        """
        keys = []
        if data:
            self._bytes += data
            self._received_at = self._clock()
        while self._bytes and not _PREFIX.fullmatch(self._bytes):
            keys.append(self._take_key())
        if self._bytes and self._clock() - self._received_at >= KEY_PATIENCE:
            keys.append(UNKNOWN if self._bytes.strip(b"\x1b") else ESCAPE)
            self._bytes = b""
        return keys

    def _take_key(self) -> str:
        match = _SEQUENCE.match(self._bytes) or _PREFIX.match(self._bytes) or _CHARACTER.match(self._bytes)
        assert match
        code, self._bytes = match.group(), self._bytes[match.end() :]
        if code.startswith(b"\x1b"):
            arrow = _ARROW.fullmatch(code)
            return _ARROWS[arrow.group(1)] if arrow else UNKNOWN
        if code in _PLAIN:
            return _PLAIN[code]
        return code.decode() if code.isascii() and code.decode().isprintable() else UNKNOWN


class Command(NamedTuple):
    """Velocities forward, left and up (m/s), and yaw rate to the left (rad/s)."""

    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    wz: float = 0.0

    def after(self, key: str, keys: Mapping[str, Command]) -> Command | None:
        """Return the command after a key press; None for a key that is not in `keys` and not the space bar.

        A capital letter, as with Shift, makes a larger step.
        """
        if key == " ":
            return Command()
        change = keys.get(key) or keys.get(key.lower())
        if change is None:
            return None
        factor = 1.0 if key in keys else _CAPITAL_FACTOR
        return Command(*(old + factor * step for old, step in zip(self, change))).rounded()

    def rounded(self) -> Command:
        """Return the command without the rounding errors of summed steps."""
        return Command(*(round(value, 6) for value in self))

    def __str__(self) -> str:
        return "vx {:+.2f}  vy {:+.2f}  vz {:+.2f} m/s   wz {:+.2f} rad/s".format(*self)


_ARROW_KEYS = {
    UP: Command(vx=_STEP),
    DOWN: Command(vx=-_STEP),
    LEFT: Command(vy=_STEP),
    RIGHT: Command(vy=-_STEP),
}
# The change by each key, for the cockpit's keys and for those of demo_teleop, the course's own node, with two more
# keys for the height. web/src/teleop.js has a copy of the cockpit's map.
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
    """The command that the simulator publishes as in force, and the command last sent. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """`clock` must be monotonic (s)."""
        self._clock = clock
        self._lock = threading.Lock()
        self.reset()

    def reset(self) -> None:
        """Forget both commands, because the simulator is gone or was replaced."""
        with self._lock:
            self.published: Command | None = None
            self.sent = Command()
            self._is_pending = False  # `sent` is not in force yet
            self._received = 0  # since `sent`
            self._sent_at = self._clock()

    @property
    def next(self) -> Command:
        """The command that a key press changes: the one in force, or the one sent if it is not in force yet."""
        with self._lock:
            return self.sent if self._is_pending or self.published is None else self.published

    def on_sent(self, command: Command) -> None:
        """Store a command that is being sent."""
        with self._lock:
            self.sent, self._is_pending = command, True
            self._received, self._sent_at = 0, self._clock()

    def on_published(self, command: Command) -> None:
        """Store the command that the simulator has published as in force.

        If it differs from the one sent, it may be an older one that arrives late; after a while it must be from another
        node.
        """
        with self._lock:
            self.published = command.rounded()
            self._received += 1
            is_overdue = self._received > 1 and self._clock() - self._sent_at > _COMMAND_TIMEOUT
            if self.published == self.sent or is_overdue:
                self._is_pending = False
