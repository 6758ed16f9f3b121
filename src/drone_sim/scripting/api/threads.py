"""`sim`: threads, which wait while the simulation goes on.

They are coroutines: one runs until it waits or switches, or has called so many functions of the API that it is switched
by itself, and goes on in the next step, before the actuation of all scripts. So a flight is the same every time.
What a function waits for is decided here, for Lua and for clients outside, too; Lua leaves its coroutines itself, and
counts the calls, in threads.lua: they cannot be left through Python.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.control import Wait, has_passed
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.types import Name, Number, WrongValue, numbers

_THREAD = 1


class Threads(Functions):
    """Threads, which wait while the simulation goes on."""

    @sim("345")
    def switchThread(self) -> Wait:
        """Let the simulation go on; return in the next step."""
        now = self._context.clock.steps
        return self._wait_for(lambda: self._context.clock.steps != now)

    @sim("5", **{"yield": "5"})  # a word that Python keeps for itself
    def step(self, _wait: bool = True) -> Wait:
        """Let the simulation go on; return in the next step (4.x)."""
        return self.switchThread()

    @sim("345")
    def wait(self, seconds: Number, _simulated: bool = True) -> Wait:
        """Wait for so many simulated seconds, whatever the second argument says; return by how much it is late."""
        (duration,) = numbers((seconds,), 1)
        clock = self._context.clock
        end = clock.time + duration
        return self._wait_for(has_passed(lambda: clock.time, duration), lambda: clock.time - end)

    @sim("345")
    def waitForSignal(self, name: Name) -> Wait:
        """Return the value of a signal of any kind, as soon as it is set."""
        if not isinstance(name, str):
            raise WrongValue("the name of a signal must be a string")
        find = functools.partial(self._context.signals.find, name)
        return self._wait_for(lambda: find() is not None, find, by_steps=False)

    def _wait_for(
        self, over: Callable[[], bool], value: Callable[[], Any] = lambda: None, by_steps: bool = True
    ) -> Wait:
        return Wait(over, value, self.getThreadExitRequest, by_steps)

    # ---- when it is switched by itself

    @sim("345")
    def setThreadSwitchTiming(self, milliseconds: Number) -> None:
        """Switch by itself after so many "milliseconds", 2 to 200: 100 calls of the API stand for one."""
        self._surroundings.turns.set_timing(numbers((milliseconds,), 1)[0])

    @sim("345", setAutoYield="", setThreadSwitchAllowed="4")
    def setThreadAutomaticSwitch(self, allowed: bool | int) -> int:
        """Forbid (false) or allow again (true) that the thread is switched by itself.

        A number sets the level: how many times it is forbidden. Return the level before.
        """
        return self._surroundings.turns.set_automatic(allowed)

    @sim("345", getAutoYield="", getThreadSwitchAllowed="4")
    def getThreadAutomaticSwitch(self) -> bool:
        """Tell whether the thread is switched by itself."""
        return self._surroundings.turns.is_automatic

    @sim("5")
    def setStepping(self, enabled: bool) -> int:
        """Switch only where the thread calls `step` (4.x)."""
        return self._surroundings.turns.set_automatic(not enabled)

    @sim("5")
    def acquireLock(self) -> None:
        """Forbid that the thread is switched by itself, until releaseLock (4.x)."""
        self._surroundings.turns.set_automatic(False)

    @sim("5")
    def releaseLock(self) -> None:
        """Allow again that the thread is switched by itself (4.x)."""
        self._surroundings.turns.set_automatic(True)

    # ---- what is as it is

    @sim("345")
    def getThreadId(self) -> int:
        """Return 1: a script has one thread."""
        return _THREAD

    @sim("5", getThreadExistRequest="5")  # so spelt in older versions
    def getThreadExitRequest(self) -> bool:
        """Tell whether the simulation ends, and the thread should."""
        return self._context.control.is_exit_requested

    @sim("345")
    def setThreadResumeLocation(self, _location: int, _order: int = 0) -> int:
        """Do nothing: threads go on before the actuation of all scripts, in the order of the tree."""
        return 1

    @sim("3")
    def delegateChildScriptExecution(self) -> int:
        """Do nothing: the simulation calls the scripts below by itself (3.0)."""
        return 1
