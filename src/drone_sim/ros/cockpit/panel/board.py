"""Contents of the page's panels as JSON: browsers get each change, and a new browser gets everything."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from drone_sim.message_text import near_names, shown

NO_SIMULATION = "no simulation"  # the status
_MAX_LINES = 200  # of the log
_MAX_LENGTH = 600  # characters of a line
_Value = TypeVar("_Value")


class Board:
    """Parts of the panels by name. The version lets a browser ignore an older message that arrives late."""

    def __init__(self, tell: Callable[[Mapping[str, Any]], None]):
        """`tell` sends a message to all browsers, and may be called in any thread."""
        self._tell = tell
        self._lock = threading.Lock()
        self._parts: dict[str, Any] = {}
        self._log: deque[str] = deque(maxlen=_MAX_LINES)
        self._version = 0

    def show(self, part: str, content: Any) -> None:
        """Replace the content of a part, which must be JSON."""
        with self._lock:
            if part in self._parts and self._parts[part] == content:
                return
            self._version += 1
            self._parts[part] = content
            self._tell({"panel": {part: content}, "version": self._version})

    def get(self, part: str, default: Any = None) -> Any:
        return self._parts.get(part, default)

    def log(self, line: str) -> None:
        """Add a line to the log, which removes its oldest line when it is full."""
        with self._lock:
            self._log.append(line[:_MAX_LENGTH])
            self._tell({"log": line[:_MAX_LENGTH]})

    def whole(self, _message: Mapping[str, Any]) -> dict[str, Any]:
        """Return all parts and the log, for a new browser."""
        with self._lock:
            return {"panel": dict(self._parts), "version": self._version, "lines": list(self._log)}


# ---- checks of messages from browsers


def one_of(message: Mapping[str, Any], key: str, allowed: Sequence[str]) -> str:
    """Return the value of a key. Raises ValueError if it is not one of `allowed`."""
    value = message.get(key)
    if not isinstance(value, str) or value not in allowed:
        known = near_names(str(value)[:80], allowed) if allowed else "there are none now"
        raise ValueError(f"{key} = {shown(value)}: does not exist; {known}")
    return value


def number(key: str, value: Any, low: float | None, high: float | None) -> float:
    """Return the value as a number. Raises ValueError if it is not from `low` to `high`; None means no limit."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if is_number and (low is None or value >= low) and (high is None or value <= high):
        return float(value)
    ends = [f"{word} {end:g}" for word, end in (("from", low), ("to", high)) if end is not None]
    raise ValueError(f"{key} = {shown(value)}: must be a number {' '.join(ends)}".rstrip())
