"""`sim`: threads, which wait while the simulation goes on.

They are coroutines: one runs until it waits or switches, or has called so many functions of the API that it is switched
by itself, and goes on in the next step, before the actuation of all scripts. So a flight is the same every time.
Lua scripts have these functions of their own, in threads.lua: a coroutine of Lua's cannot be left through Python.
"""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.calls import Function, WrongValue, numbers, public_functions
from drone_sim.scripting.api.host import Surroundings
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.turns import SOON, Turns
from drone_sim.scripting.api.types import Name, Number

_THREAD = 1


class Threads:
    """The functions on the thread of a script."""

    def __init__(self, surroundings: Surroundings, signals: Signals):
        """Take the clock, the script's turns, and the signals that it may wait for."""
        self._clock = surroundings.clock
        self._turns: Turns = surroundings.turns
        self._signals = signals
        self._control = surroundings.control

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        own = {name: f for name, f in public_functions((self,)).items() if name != "functions"}
        return {**own, "yield": self.step}  # a word that Python keeps for itself

    def switchThread(self) -> None:
        """Let the simulation go on; return in the next step."""
        self._turns.switch()

    def step(self, _wait: bool = True) -> None:
        """Let the simulation go on; return in the next step (4.x)."""
        self._turns.switch()

    def wait(self, seconds: Number, _simulated: bool = True) -> float:
        """Wait for so many simulated seconds, whatever the second argument says; return by how much it is late."""
        end = self._clock() + numbers((seconds,), 1)[0]
        while self._clock() < end - SOON:
            self._turns.switch()
            if self.getThreadExitRequest():
                break
        return self._clock() - end

    def waitForSignal(self, name: Name) -> Any:
        """Return the value of a signal of any kind, as soon as it is set."""
        if not isinstance(name, str):
            raise WrongValue("the name of a signal is a string")
        while True:
            for get in (self._signals.getInt32Signal, self._signals.getFloatSignal, self._signals.getStringSignal):
                value = get(name)
                if value is not None:
                    return value
            self._turns.switch()
            if self.getThreadExitRequest():
                return None

    # ---- when it is switched by itself

    def setThreadSwitchTiming(self, milliseconds: Number) -> None:
        """Switch by itself after so many "milliseconds", 2 to 200: 100 calls of the API stand for one."""
        self._turns.set_timing(numbers((milliseconds,), 1)[0])

    def setThreadAutomaticSwitch(self, allowed: bool | int) -> int:
        """Forbid (false) or allow again (true) that the thread is switched by itself.

        A number sets how often it is forbidden; return how often it was.
        """
        return self._turns.set_automatic(allowed)

    def getThreadAutomaticSwitch(self) -> bool:
        """Tell whether the thread is switched by itself."""
        return self._turns.is_automatic

    def setAutoYield(self, allowed: bool | int) -> int:
        """Do what setThreadAutomaticSwitch does (4.x)."""
        return self._turns.set_automatic(allowed)

    def getAutoYield(self) -> bool:
        """Tell whether the thread is switched by itself (4.x)."""
        return self._turns.is_automatic

    def setStepping(self, enabled: bool) -> int:
        """Switch only where the thread calls `step` (4.x)."""
        return self._turns.set_automatic(not enabled)

    def acquireLock(self) -> None:
        """Forbid that the thread is switched by itself, until releaseLock (4.x)."""
        self._turns.set_automatic(False)

    def releaseLock(self) -> None:
        """Allow again that the thread is switched by itself (4.x)."""
        self._turns.set_automatic(True)

    # ---- what is as it is

    def getThreadId(self) -> int:
        """Return 1: a script has one thread."""
        return _THREAD

    def getThreadExitRequest(self) -> bool:
        """Tell whether the simulation ends, and the thread should."""
        return self._control.is_stopping or self._control.is_ending

    def getThreadExistRequest(self) -> bool:
        """Tell whether the simulation ends, and the thread should (so spelt in older versions)."""
        return self.getThreadExitRequest()

    def setThreadResumeLocation(self, _location: int, _order: int = 0) -> int:
        """Do nothing: threads go on before the actuation of all scripts, in the order of the tree."""
        return 1

    def delegateChildScriptExecution(self) -> int:
        """Do nothing: the simulation calls the scripts below by itself (3.0)."""
        return 1
