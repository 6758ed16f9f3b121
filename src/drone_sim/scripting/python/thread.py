"""Thread of a Python child script: a greenlet, that is, a function that can be suspended and resumed.

It runs in the simulation's own thread, within the script's time limit, like every other function of the script.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NoReturn

import greenlet

from drone_sim.scripting.api.calls import Api, contents
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.python.inspection import LineTracer
from drone_sim.scripting.time_limit import ScriptStopped

_abandoned: list[greenlet.greenlet] = []  # that did not end; referenced, because Python resumes them to free them


class PythonThread:
    """A thread that runs in turns with the simulation."""

    def __init__(self, turns: Turns):
        """Create it; `turns` decide when it is suspended. `take_turn` starts it."""
        self._turns = turns
        self._greenlet: greenlet.greenlet | None = None
        self.has_ended = False
        self.tracer: LineTracer | None = None  # set while there are breakpoints
        turns.leave = self._suspend

    def counted(self, api: Api) -> Api:
        """Return a module of the API that counts the thread's calls."""
        name, functions, constants = contents(api)
        return Api(name, {key: self._counted(function) for key, function in functions.items()}, constants)

    def _counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            if greenlet.getcurrent() is self._greenlet:
                self._turns.count()
            return function(*arguments, **named)

        return call

    def take_turn(self, function: Callable[[], Any]) -> None:
        """Start or resume `function` until it is suspended or has ended. Raises its exceptions."""
        if self._greenlet is None:
            self._greenlet = greenlet.greenlet(lambda: self._start(function))
        self._turns.begin()
        self._greenlet.parent = greenlet.getcurrent()
        try:
            self._greenlet.switch()
        finally:
            self.has_ended = self._greenlet.dead

    def _start(self, function: Callable[[], Any]) -> Any:
        if self.tracer is not None:
            self.tracer.resume()
        return function()

    def _suspend(self) -> bool:
        if greenlet.getcurrent() is not self._greenlet or self._greenlet.parent is None:
            return False
        self._greenlet.parent.switch()
        if self.tracer is not None:  # tracing is switched on or off for each greenlet
            self.tracer.resume()
        return True

    def end(self) -> None:
        """Raise ScriptStopped in it: its `finally` blocks run, but no `except` of the script catches this."""
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
