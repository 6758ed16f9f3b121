"""Control of the simulation by scripts: stop and pause, waits, and turns of threads."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, NamedTuple

from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import WrongValue

STOP, PAUSE = "stop", "pause"
CALLS_PER_MS = 100  # calls of the API that count as a millisecond in V-REP
DEFAULT_MS = 2.0
SHORTEST_MS, LONGEST_MS = 2.0, 200.0
_TOLERANCE = 1e-9  # s, because sums of steps are not exact

NO_THREAD = "only in a thread: in sysCall_thread, sysCall_threadmain, or a coroutine"


class Control:
    """Requests of scripts to stop or pause the simulation; the Player reads `asked` after each step."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.asked = ""  # STOP, PAUSE or ''
        self.is_stopped = False  # while customization scripts are called before the start
        self.is_stopping = False  # while threads have their last turns
        self.is_ending = False  # while cleanup is called

    @property
    def is_exit_requested(self) -> bool:
        """Whether the simulation is ending, so that threads should end."""
        return self.is_stopping or self.is_ending

    def state(self, time: float) -> int:
        """Return CoppeliaSim's state of the simulation at a simulated time in s."""
        if self.is_stopped:
            return CONSTANTS["simulation_stopped"]
        if self.is_ending:
            return CONSTANTS["simulation_advancing_lastbeforestop"]
        if self.asked == STOP or self.is_stopping:
            return CONSTANTS["simulation_advancing_abouttostop"]
        return CONSTANTS["simulation_advancing_running" if time > 0 else "simulation_advancing_firstafterstop"]

    def take(self) -> str:
        """Return the request, and remove it."""
        asked, self.asked = self.asked, ""
        return asked


class Call(NamedTuple):
    """A call of one of the script's own functions, which is given by name, as itself, or (Lua) by its number."""

    callback: Any
    arguments: list[Any]


# Yields None once in each step, and calls to make, whose results are sent to it.
Steps = Generator[Call | None, Any, None]


class Wait:
    """The wait of an API function, for threads in either language and for remote clients."""

    def __init__(
        self,
        over: Callable[[], bool],
        value: Callable[[], Any] = lambda: None,
        given_up: Callable[[], bool] = lambda: False,
        by_steps: bool = True,
    ):
        """`over` returns whether the wait has ended; then `value` returns the result of the API function.

        `given_up` returns, after each step, whether a thread continues although the wait has not ended.
        `by_steps`: whether the wait can only end by steps of the simulation.
        """
        self.over = over
        self.value = value
        self.by_steps = by_steps
        self._given_up = given_up

    def __iter__(self) -> Steps:
        """Yield once in each step as long as a thread has to wait."""
        while not self.over():
            yield None
            if self._given_up():
                return


class Action(Wait):
    """The work of an API function in several steps, for which a thread waits."""

    def __init__(self, steps: Steps, value: Callable[[], Any]):
        """`steps` does the work; then `value` returns the result of the API function."""
        super().__init__(lambda: False, value)
        self._steps = steps

    def __iter__(self) -> Steps:
        """Return its steps, which can be run only once."""
        return self._steps


def has_passed(clock: Callable[[], float], seconds: float) -> Callable[[], bool]:
    """Return a function that returns whether some seconds of a clock have passed since this call."""
    end = clock() + seconds - _TOLERANCE
    return lambda: clock() >= end


def waits(function: Callable[..., Any]) -> bool:
    """Return whether an API function returns a Wait."""
    return function.__annotations__.get("return") == Wait.__name__


class NoThread(ValueError):
    """Call of a function that has to wait outside of a thread; the message names the function."""


class Turns:
    """Switching between the thread of a Python script and the simulation."""

    def __init__(self) -> None:
        """Create it with V-REP's default timing, and without a thread."""
        # Suspends the thread until the next step; returns False if it does not run.
        self.leave: Callable[[], bool] = lambda: False
        self._forbidden = 0
        self._called = 0
        self._most = int(DEFAULT_MS * CALLS_PER_MS)

    def begin(self) -> None:
        self._called = 0

    def wait_for(self, wait: Wait, function: str, call: Callable[[Call], Any]) -> Any:
        """Suspend the thread as long as a function has to wait; return the function's result. Raises NoThread.

        `call` executes calls of the script's own functions for the wait.
        """
        steps, answer = iter(wait), None
        while True:
            try:
                request = steps.send(answer)
            except StopIteration:
                return wait.value()
            answer = call(request) if request else None
            if not request and not self.leave():
                raise NoThread(f"{function}: {NO_THREAD}")

    def count(self) -> None:
        """Count an API call in the thread; suspend the thread at the end of its turn."""
        self._called += 1
        if self._called > self._most and not self._forbidden:
            self.leave()
            self._called = 1

    @property
    def is_automatic(self) -> bool:
        return not self._forbidden

    def set_automatic(self, allowed: bool | int) -> int:
        """Raise (False), lower (True) or set the level that forbids automatic switching (0: allowed).

        Return the level before.
        """
        before = self._forbidden
        if not isinstance(allowed, (bool, int, float)) or not 0 <= allowed < 1e9:
            raise WrongValue("expected true, false, or a level of 0 or more")
        self._forbidden = int(allowed) if not isinstance(allowed, bool) else max(0, before + (-1 if allowed else 1))
        return before

    def set_timing(self, milliseconds: float) -> None:
        """Set the length of a turn in "milliseconds" (see CALLS_PER_MS)."""
        self._most = int(min(max(SHORTEST_MS, milliseconds), LONGEST_MS) * CALLS_PER_MS)
