"""What the page's panels show, as JSON: every browser is told of what changes, and a new one gets the whole."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from drone_sim.message_text import near_names, shown

_LINES = 200  # of the log
_LONGEST = 600  # characters of a line
_Value = TypeVar("_Value")


class Board:
    """Parts by name, with a version, so that in a browser an older whole does not overwrite a newer part."""

    def __init__(self, tell: Callable[[Mapping[str, Any]], None]):
        """`tell` sends a message to all browsers. Any thread may call."""
        self._tell = tell
        self._lock = threading.Lock()
        self._parts: dict[str, Any] = {}
        self._log: deque[str] = deque(maxlen=_LINES)
        self._version = 0

    def show(self, part: str, content: Any) -> None:
        """Show a part, in the place of what it was; `content` is JSON."""
        with self._lock:
            if part in self._parts and self._parts[part] == content:
                return
            self._version += 1
            self._parts[part] = content
            self._tell({"panel": {part: content}, "version": self._version})

    def get(self, part: str, default: Any = None) -> Any:
        """Return what a part shows."""
        return self._parts.get(part, default)

    def log(self, line: str) -> None:
        """Add a line to the log, which drops its oldest line when it is full."""
        with self._lock:
            self._log.append(line[:_LONGEST])
            self._tell({"log": line[:_LONGEST]})

    def whole(self, _message: Mapping[str, Any]) -> dict[str, Any]:
        """Return everything, for a browser that has just come."""
        with self._lock:
            return {"panel": dict(self._parts), "version": self._version, "lines": list(self._log)}


# ---- what a browser asks for is checked as a message from outside


def one_of(message: Mapping[str, Any], key: str, allowed: Sequence[str]) -> str:
    """Return what a message says under a key. Raises ValueError for what is not among those."""
    value = message.get(key)
    if not isinstance(value, str) or value not in allowed:
        known = near_names(str(value)[:80], allowed) if allowed else "there are none now"
        raise ValueError(f"{key} = {shown(value)}: does not exist; {known}")
    return value


def number(key: str, value: Any, low: float | None, high: float | None) -> float:
    """Return a number from `low` to `high`, None for no end. Raises ValueError."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if is_number and (low is None or value >= low) and (high is None or value <= high):
        return float(value)
    ends = [f"{word} {end:g}" for word, end in (("from", low), ("to", high)) if end is not None]
    raise ValueError(f"{key} = {shown(value)}: must be a number {' '.join(ends)}".rstrip())
