"""`sim`: threads, which can wait while the simulation runs.

They are coroutines. A thread runs until it waits or switches, or has called a number of API functions; it continues in
the next step, before the actuation of all scripts. So every flight is the same. The functions here define the waits for
Lua, Python and remote clients. In Lua, threads.lua suspends the coroutines and counts their calls, because they cannot
be suspended through Python.
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
    """Threads, which can wait while the simulation runs."""

    @sim("345")
    def switchThread(self) -> Wait:
        """Suspend the thread until the next step."""
        now = self._context.clock.steps
        return self._wait_for(lambda: self._context.clock.steps != now)

    @sim("5", **{"yield": "5"})  # a keyword in Python
    def step(self, _wait: bool = True) -> Wait:
        """Suspend the thread until the next step (4.x)."""
        return self.switchThread()

    @sim("345")
    def wait(self, seconds: Number, _simulated: bool = True) -> Wait:
        """Wait for a simulated time in s; the second argument is ignored. Return the delay beyond it."""
        (duration,) = numbers((seconds,), 1)
        clock = self._context.clock
        end = clock.time + duration
        return self._wait_for(has_passed(lambda: clock.time, duration), lambda: clock.time - end)

    @sim("345")
    def waitForSignal(self, name: Name) -> Wait:
        """Wait until a signal of any kind is set; return its value."""
        if not isinstance(name, str):
            raise WrongValue("the name of a signal must be a string")
        find = functools.partial(self._context.signals.find, name)
        return self._wait_for(lambda: find() is not None, find, by_steps=False)

    def _wait_for(
        self, over: Callable[[], bool], value: Callable[[], Any] = lambda: None, by_steps: bool = True
    ) -> Wait:
        return Wait(over, value, self.getThreadExitRequest, by_steps)

    # ---- automatic switching

    @sim("345")
    def setThreadSwitchTiming(self, milliseconds: Number) -> None:
        """Set the "milliseconds" (2 to 200) until a thread is switched automatically; one is 100 calls of the API."""
        self._services.turns.set_timing(numbers((milliseconds,), 1)[0])

    @sim("345", setAutoYield="", setThreadSwitchAllowed="4")
    def setThreadAutomaticSwitch(self, allowed: bool | int) -> int:
        """Forbid (false) or allow again (true) automatic switching of the thread.

        A number sets how many times it is forbidden. Return the number before.
        """
        return self._services.turns.set_automatic(allowed)

    @sim("345", getAutoYield="", getThreadSwitchAllowed="4")
    def getThreadAutomaticSwitch(self) -> bool:
        """Return whether the thread is switched automatically."""
        return self._services.turns.is_automatic

    @sim("5")
    def setStepping(self, enabled: bool) -> int:
        """Enable or disable stepping, in which the thread is switched only when it calls `step` (4.x)."""
        return self._services.turns.set_automatic(not enabled)

    @sim("5")
    def acquireLock(self) -> None:
        """Forbid automatic switching of the thread until releaseLock (4.x)."""
        self._services.turns.set_automatic(False)

    @sim("5")
    def releaseLock(self) -> None:
        """Allow automatic switching of the thread again (4.x)."""
        self._services.turns.set_automatic(True)

    # ---- other functions

    @sim("345")
    def getThreadId(self) -> int:
        """Return 1: a script has one thread."""
        return _THREAD

    @sim("5", getThreadExistRequest="5")  # spelled like this in older versions
    def getThreadExitRequest(self) -> bool:
        """Return whether the simulation is ending, so that the thread should end."""
        return self._context.control.is_exit_requested

    @sim("345")
    def setThreadResumeLocation(self, _location: int, _order: int = 0) -> int:
        """Do nothing: threads continue before the actuation of all scripts, in the order of the tree."""
        return 1

    @sim("3")
    def delegateChildScriptExecution(self) -> int:
        """Do nothing: the simulation calls the scripts of descendants itself (3.0)."""
        return 1
