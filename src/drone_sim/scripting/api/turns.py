"""Whose turn it is: a script's thread, or the simulation."""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.scripting.api.calls import WrongValue

CALLS_PER_MS = 100  # of the API, that stand for a millisecond of V-REP's
DEFAULT_MS = 2.0
SHORTEST_MS, LONGEST_MS = 2.0, 200.0
SOON = 1e-9  # s: sums of steps are not exact

NO_THREAD = "only in a thread: in sysCall_thread, sysCall_threadmain, or a coroutine"


def _no_thread() -> None:
    raise ValueError(NO_THREAD)


class Turns:
    """When the thread of a script is switched."""

    def __init__(self) -> None:
        """Begin with V-REP's default timing, and no thread."""
        self.leave: Callable[[], None] = _no_thread  # leaves the thread; returns in the next step
        self._forbidden = 0
        self._called = 0
        self._most = int(DEFAULT_MS * CALLS_PER_MS)

    def begin(self) -> None:
        """Begin a turn."""
        self._called = 0

    def switch(self) -> None:
        """Leave the thread until the next step. Raises ValueError where there is none."""
        self.leave()

    def count(self) -> None:
        """Count a call of the API in a thread; leave it where it has had its turn."""
        self._called += 1
        if self._called > self._most and not self._forbidden:
            self.switch()
            self._called = 1

    @property
    def is_automatic(self) -> bool:
        """Whether the thread is switched by itself."""
        return not self._forbidden

    def set_automatic(self, allowed: bool | int) -> int:
        """Forbid it once more, allow it once more, or set how often it is forbidden; return how often it was."""
        before = self._forbidden
        if not isinstance(allowed, (bool, int, float)) or not 0 <= allowed < 1e9:
            raise WrongValue("true, false, or a level of 0 or more is expected")
        self._forbidden = int(allowed) if not isinstance(allowed, bool) else max(0, before + (-1 if allowed else 1))
        return before

    def set_timing(self, milliseconds: float) -> None:
        """Let the thread have so many "milliseconds" for a turn."""
        self._most = int(min(max(SHORTEST_MS, milliseconds), LONGEST_MS) * CALLS_PER_MS)
