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
    """What the scripts of a simulation share of it; whoever plays the simulation looks at `asked` after each step."""

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
        """`over` tells whether it is over, `value` returns what the function returns then.

        `given_up` tells, once it has been waited, whether a thread shall go on although it is not over; `by_steps`:
        whether nothing but steps of the simulation brings its end.
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
    """What a function of the API does step by step, while a thread waits for its end."""

    def __init__(self, steps: Steps, value: Callable[[], Any]):
        """`steps` are what it does; `value` returns what the function returns then."""
        super().__init__(lambda: False, value)
        self._steps = steps

    def __iter__(self) -> Steps:
        """Return its steps, which are there once."""
        return self._steps


def has_passed(clock: Callable[[], float], seconds: float) -> Callable[[], bool]:
    """Return what tells whether so many seconds of a clock have passed since now."""
    end = clock() + seconds - _SOON
    return lambda: clock() >= end


def waits(function: Callable[..., Any]) -> bool:
    """Tell whether a function of the API returns what is to be waited for."""
    return function.__annotations__.get("return") == Wait.__name__


class NoThread(ValueError):
    """A script waits where it has no thread that could be left; one line that names the function."""


class Turns:
    """When the thread of a Python script is left."""

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
        """Leave the thread as long as a function has to wait; return what it brings. Raises NoThread.

        `call` calls what the script is to be asked meanwhile.
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
        """Forbid it once more, allow it once more, or set how often it is forbidden; return how often it was."""
        before = self._forbidden
        if not isinstance(allowed, (bool, int, float)) or not 0 <= allowed < 1e9:
            raise WrongValue("true, false, or a level of 0 or more is expected")
        self._forbidden = int(allowed) if not isinstance(allowed, bool) else max(0, before + (-1 if allowed else 1))
        return before

    def set_timing(self, milliseconds: float) -> None:
        """Let the thread have so many "milliseconds" for a turn."""
        self._most = int(min(max(SHORTEST_MS, milliseconds), LONGEST_MS) * CALLS_PER_MS)
