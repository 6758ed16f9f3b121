"""From the bytes that a terminal sends to the keys that were pressed. Neither a terminal nor ROS is needed."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

UP, DOWN, LEFT, RIGHT, BACKSPACE, ESCAPE, UNKNOWN = "up", "down", "left", "right", "backspace", "escape", "unknown"
PATIENCE = 0.5  # s, for what may follow an ESC; a slow line sends a sequence in pieces

# ECMA-48: ESC [ parameters final, or ESC O final. The Linux console adds ESC [ [ final, and Alt an ESC before a key.
_WHOLE = re.compile(rb"\x1b+(?:\[\[.|\[[0-?]*[ -/]*[@-Z\\-~]|O[0-9;]*[@-~]|[^\x1b\[O])", re.DOTALL)
_BEGINNING = re.compile(rb"\x1b+(?:\[\[?|\[[0-?]*[ -/]*|O[0-9;]*)?")
_ARROW = re.compile(rb"\x1b+[\[O][0-9;]*([ABCD])")
_ARROWS = {b"A": UP, b"B": DOWN, b"C": RIGHT, b"D": LEFT}
_CHARACTER = re.compile(rb"[\xc0-\xff][\x80-\xbf]*|.", re.DOTALL)  # UTF-8
_PLAIN = {b"\x7f": BACKSPACE, b"\x08": BACKSPACE}


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

        An ESC after which nothing comes for PATIENCE is the key itself; any other beginning of a sequence is dropped.
        """
        keys = []
        if data:
            self._bytes += data
            self._came = self._clock()
        while self._bytes and not _BEGINNING.fullmatch(self._bytes):
            keys.append(self._take())
        if self._bytes and self._clock() - self._came >= PATIENCE:
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
