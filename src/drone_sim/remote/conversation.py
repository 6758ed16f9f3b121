"""Tasks of remote clients, which may wait, and the clients' control of simulation steps.

A task is a generator that yields what it waits for, and returns the list of values for the client:

    values = yield Call("on_message", [message])     the client calls one of its functions
    yield Until(lambda: simulation.steps > steps)    the simulation runs

The simulation steps when every client in stepping mode has requested it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Function


class Call(NamedTuple):
    """A call of a client's function, by name."""

    function: str
    arguments: list[Any]


class Until(NamedTuple):
    """A condition that becomes true in the course of time, without an action of the client."""

    over: Callable[[], bool]


class RequestRefused(Exception):
    """A request cannot be executed; the one-line reason, which the client raises as an exception."""


Task = Generator[Call | Until, Any, Any]
Watched = Callable[[str, Function], Function]  # returns the function to call in place of a named function


def unwatched(_name: str, function: Function) -> Function:
    return function


class ClientFunction:
    """A function of a client, represented by its name; it is called at the client's next request."""

    def __init__(self, name: str):
        self.name = name

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: a client's function cannot be called where its result is needed at once."""
        raise ValueError("a function of a remote client cannot be called here, because its result is needed at once")


def name_of(function: Any) -> str:
    """Return the client's name for its function, a ClientFunction or a string."""
    return function.name if isinstance(function, ClientFunction) else str(function)


def returned(values: list[Any]) -> Any:
    """Return the result of a client's function: None, a value, or a tuple of values."""
    return None if not values else values[0] if len(values) == 1 else tuple(values)


class Stepping:
    """A client's control of the steps. As in CoppeliaSim, stepping must be switched off as often as on."""

    def __init__(self) -> None:
        self.level = 0
        self.locks = 0
        self._waits: list[Until] = []

    def set(self, enabled: bool) -> int:
        """Raise or lower the level; above 0, each step waits for this client. Return the previous level."""
        before = self.level
        self.level = before + 1 if enabled else max(0, before - 1)
        return before

    def lock(self, more: int) -> None:
        """Add `more` locks (negative: remove); the simulation is blocked while there are locks."""
        self.locks = max(0, self.locks + more)

    def wait(self, until: Until) -> Until:
        """Let the simulation run until a condition is true; return the condition."""
        self._waits = [wait for wait in self._waits if not wait.over()]
        self._waits.append(until)
        return until

    def let_go(self) -> None:
        """Stop holding the simulation: remove all levels and locks."""
        self.level = self.locks = 0

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait for this client."""
        return bool(self.locks or (self.level and all(wait.over() for wait in self._waits)))


class RemoteApi:
    """Remote clients, which may hold the simulation's steps. This base class has no clients; servers derive from it."""

    address = ""

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait."""
        return False

    def wait(self, seconds: float) -> None:
        """Sleep for `seconds`, or until a request has been handled."""
        time.sleep(seconds)

    def serve(self) -> None:
        """Handle all requests received."""

    def wake(self) -> None:
        """End a `wait`; any thread may call it."""

    def close(self) -> None:
        """Disconnect all clients."""
