"""The thread of a Python child script: a greenlet, a function that can be left and gone on with later.

It runs in the simulation's own thread, under the script's time limit, as every other function of the script.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NoReturn

import greenlet

from drone_sim.scripting.api.calls import Api, contents
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.python.tracing import LineTracer
from drone_sim.scripting.time_limit import ScriptStopped

_abandoned: list[greenlet.greenlet] = []  # that would not end: kept, or Python would run them once more to free them


class PythonThread:
    """A thread that takes turns with the simulation."""

    def __init__(self, turns: Turns):
        """`turns` decide when it is left; it has not begun."""
        self._turns = turns
        self._greenlet: greenlet.greenlet | None = None
        self.has_ended = False
        self.tracer: LineTracer | None = None  # while there are breakpoints
        turns.leave = self._leave

    def counted(self, api: Api) -> Api:
        """Return a module of the API that counts what the thread calls."""
        name, functions, constants = contents(api)
        return Api(name, {key: self._counted(one) for key, one in functions.items()}, constants)

    def _counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            if greenlet.getcurrent() is self._greenlet:
                self._turns.count()
            return function(*arguments, **named)

        return call

    def take_turn(self, function: Callable[[], Any]) -> None:
        """Begin a function, or go on with it, until it is left or has ended. Raises what it raises."""
        if self._greenlet is None:
            self._greenlet = greenlet.greenlet(lambda: self._begin(function))
        self._turns.begin()
        self._greenlet.parent = greenlet.getcurrent()
        try:
            self._greenlet.switch()
        finally:
            self.has_ended = self._greenlet.dead

    def _begin(self, function: Callable[[], Any]) -> Any:
        if self.tracer is not None:
            self.tracer.resume()
        return function()

    def _leave(self) -> bool:
        if greenlet.getcurrent() is not self._greenlet or self._greenlet.parent is None:
            return False
        self._greenlet.parent.switch()
        if self.tracer is not None:  # Python keeps for each greenlet whether it is traced
            self.tracer.resume()
        return True

    def end(self) -> None:
        """End it where it is: its `finally` runs, and no handler of the script sees why."""
        self.has_ended = True
        if self._greenlet is None or self._greenlet.dead:
            return
        self._turns.leave = _stop
        self._greenlet.parent = greenlet.getcurrent()
        try:
            self._greenlet.throw(ScriptStopped)
        finally:
            if not self._greenlet.dead:
                _abandoned.append(self._greenlet)


def _stop() -> NoReturn:
    raise ScriptStopped
