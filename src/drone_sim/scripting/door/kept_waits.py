"""Waits of the coroutines of a script in another process, which refers to each of them by a number."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.control import Wait

_MAX_WAITS = 1000


class KeptWaits:
    """The waits of a script."""

    def __init__(self) -> None:
        """Create an empty table."""
        self._waits: dict[int, tuple[Any, Wait]] = {}
        self._last = 0

    def kept(self, value: Any) -> Any:
        """Return `value`, or for a Wait the number that it is stored under. Raises ValueError for too many waits."""
        if not isinstance(value, Wait):
            return value
        if len(self._waits) >= _MAX_WAITS:
            raise ValueError(f"at most {_MAX_WAITS} coroutines of a script may wait at once")
        self._last += 1
        self._waits[self._last] = iter(value), value
        return self._last

    def step(self, number: Any = None, answer: Any = None, *_: Any) -> Any:
        """Advance a wait: return ("wait",), ("call", function, arguments) or ("over", value).

        Raises ValueError for an unknown number, and any error of the wait.
        """
        if number not in self._waits:
            raise ValueError("there is no wait with this number")
        steps, wait = self._waits[number]
        try:
            call = steps.send(answer)
        except StopIteration:
            del self._waits[number]
            return "over", wait.value()
        except BaseException:
            self._waits.pop(number, None)
            raise
        return ("call", call.callback, call.arguments) if call else ("wait",)
