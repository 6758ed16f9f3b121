"""Whether the simulation goes on, and whose turn it is: a script's thread, or the simulation."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, NamedTuple

from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.types import WrongValue

STOP, PAUSE = "stop", "pause"
CALLS_PER_MS = 100  # of the API, that stand for a millisecond of V-REP's
DEFAULT_MS = 2.0
SHORTEST_MS, LONGEST_MS = 2.0, 200.0
_SOON = 1e-9  # s: sums of steps are not exact

NO_THREAD = "only in a thread: in sysCall_thread, sysCall_threadmain, or a coroutine"


class Control:
    """Requests of scripts to stop or pause, shared by all; the Player reads `asked` after each step."""

    def __init__(self) -> None:
        """Begin with nothing asked for."""
        self.clear()

    def clear(self) -> None:
        """Have nothing asked for, as at the beginning of a run."""
        self.asked = ""  # STOP, PAUSE or nothing
        self.is_stopping = False  # while threads have their last turns
        self.is_ending = False  # while cleanup is called

    @property
    def is_exit_requested(self) -> bool:
        """Whether the simulation ends, and threads should."""
        return self.is_stopping or self.is_ending

    def state(self, time: float) -> int:
        """Return CoppeliaSim's state of the simulation at a simulated time in s."""
        if self.is_ending:
            return CONSTANTS["simulation_advancing_lastbeforestop"]
        if self.asked == STOP or self.is_stopping:
            return CONSTANTS["simulation_advancing_abouttostop"]
        return CONSTANTS["simulation_advancing_running" if time > 0 else "simulation_advancing_firstafterstop"]

    def take(self) -> str:
        """Return what was asked for, and forget it."""
        asked, self.asked = self.asked, ""
        return asked


class Call(NamedTuple):
    """A call of one of the script's own functions: by name, itself, or in Lua its number."""

    callback: Any
    arguments: list[Any]


Steps = Generator[Call | None, Any, None]  # yields None once a step, and what is to be called, whose answer is sent in


class Wait:
    """What a function of the API waits for, the same for threads of either language and for clients outside."""

    def __init__(
        self,
        over: Callable[[], bool],
        value: Callable[[], Any] = lambda: None,
        given_up: Callable[[], bool] = lambda: False,
        by_steps: bool = True,
    ):
        """`over` tells whether the wait has ended; `value` then gives the return value of the API function.

        `given_up` tells, after each step of waiting, whether a thread goes on although the wait has not ended;
        `by_steps`: whether the wait can end only through steps of the simulation.
        """
        self.over = over
        self.value = value
        self.by_steps = by_steps
        self._given_up = given_up

    def __iter__(self) -> Steps:
        """Yield once a step as long as a thread has to wait."""
        while not self.over():
            yield None
            if self._given_up():
                return


class Action(Wait):
    """Work of an API function that takes several steps; a thread waits until it has ended."""

    def __init__(self, steps: Steps, value: Callable[[], Any]):
        """`steps` does the work; `value` then gives the return value of the API function."""
        super().__init__(lambda: False, value)
        self._steps = steps

    def __iter__(self) -> Steps:
        """Return its steps, which can be run only once."""
        return self._steps


def has_passed(clock: Callable[[], float], seconds: float) -> Callable[[], bool]:
    """Return a function that tells whether so many seconds of a clock have passed since this call."""
    end = clock() + seconds - _SOON
    return lambda: clock() >= end


def waits(function: Callable[..., Any]) -> bool:
    """Tell whether a function of the API returns what is to be waited for."""
    return function.__annotations__.get("return") == Wait.__name__


class NoThread(ValueError):
    """A script calls a function that has to wait, but not in a thread; one line that names the function."""


class Turns:
    """Decides when the thread of a Python script is switched."""

    def __init__(self) -> None:
        """Begin with V-REP's default timing, and no thread."""
        self.leave: Callable[[], bool] = lambda: False  # leaves the thread, if it runs; returns in the next step
        self._forbidden = 0
        self._called = 0
        self._most = int(DEFAULT_MS * CALLS_PER_MS)

    def begin(self) -> None:
        """Begin a turn."""
        self._called = 0

    def wait_for(self, wait: Wait, function: str, call: Callable[[Call], Any]) -> Any:
        """Leave the thread as long as a function has to wait; return the function's value. Raises NoThread.

        `call` carries out each Call of the script's own functions that the wait needs.
        """
        steps, answer = iter(wait), None
        while True:
            try:
                asked = steps.send(answer)
            except StopIteration:
                return wait.value()
            answer = call(asked) if asked else None
            if not asked and not self.leave():
                raise NoThread(f"{function}: {NO_THREAD}")

    def count(self) -> None:
        """Count a call of the API in a thread; leave it where it has had its turn."""
        self._called += 1
        if self._called > self._most and not self._forbidden:
            self.leave()
            self._called = 1

    @property
    def is_automatic(self) -> bool:
        """Whether the thread is switched by itself."""
        return not self._forbidden

    def set_automatic(self, allowed: bool | int) -> int:
        """Raise, lower or set the level that forbids automatic switching (0: allowed); return the level from before."""
        before = self._forbidden
        if not isinstance(allowed, (bool, int, float)) or not 0 <= allowed < 1e9:
            raise WrongValue("expected true, false, or a level of 0 or more")
        self._forbidden = int(allowed) if not isinstance(allowed, bool) else max(0, before + (-1 if allowed else 1))
        return before

    def set_timing(self, milliseconds: float) -> None:
        """Let the thread have so many "milliseconds" for a turn."""
        self._most = int(min(max(SHORTEST_MS, milliseconds), LONGEST_MS) * CALLS_PER_MS)
