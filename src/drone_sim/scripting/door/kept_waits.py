"""What the coroutines of a script in another process wait for; the script knows each by a number."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.control import Wait

_MOST = 1000


class KeptWaits:
    """The waits of a script."""

    def __init__(self) -> None:
        """Keep none yet."""
        self._waits: dict[int, tuple[Any, Wait]] = {}
        self._last = 0

    def kept(self, found: Any) -> Any:
        """Return a value, or the number under which a Wait is kept here. Raises ValueError for too many."""
        if not isinstance(found, Wait):
            return found
        if len(self._waits) >= _MOST:
            raise ValueError(f"at most {_MOST} coroutines of a script may wait at once")
        self._last += 1
        self._waits[self._last] = iter(found), found
        return self._last

    def step(self, number: Any = None, answer: Any = None, *_: Any) -> Any:
        """Go on with what is waited for: return ("wait",), ("call", function, arguments) or ("over", value).

        Raises ValueError for a number of nothing, and what the wait raises.
        """
        if number not in self._waits:
            raise ValueError("there is no wait with this number")
        steps, wait = self._waits[number]
        try:
            asked = steps.send(answer)
        except StopIteration:
            del self._waits[number]
            return "over", wait.value()
        except BaseException:
            self._waits.pop(number, None)
            raise
        return ("call", asked.callback, asked.arguments) if asked else ("wait",)
