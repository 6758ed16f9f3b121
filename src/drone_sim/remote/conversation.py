"""What a request may have to wait for before it has its answer, and who lets the simulation step meanwhile.

A task is a generator that yields what it waits for, and returns the list of values that the client gets:

    values = yield Call("on_message", [message])     the client calls a function of its own
    yield Until(lambda: simulation.steps > steps)    the simulation goes on

The simulation steps when every client that wants to be asked has said so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Function


class Call(NamedTuple):
    """A function of the client's, by name."""

    function: str
    arguments: list[Any]


class Until(NamedTuple):
    """A condition that becomes true after some time, without an action of the client."""

    over: Callable[[], bool]


class RequestRefused(Exception):
    """What a client asked for cannot be done; one line that says why, which the client raises."""


Task = Generator[Call | Until, Any, Any]
Watched = Callable[[str, Function], Function]  # returns what is called instead of a function of a name


def unwatched(_name: str, function: Function) -> Function:
    """Return the function itself."""
    return function


class ClientFunction:
    """A function of a client's, as the API gets it: a name that is kept until the client asks for something."""

    def __init__(self, name: str):
        """Take the name that the client knows it by."""
        self.name = name

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: a function that has to return at once cannot be called in a client."""
        raise ValueError("a function of a remote client cannot be called here, because its result is needed at once")


def name_of(function: Any) -> str:
    """Return the client's name for its function, which is given as a ClientFunction or as a text."""
    return function.name if isinstance(function, ClientFunction) else str(function)


def returned(values: list[Any]) -> Any:
    """Return what a client's function has returned: nothing, one value, or several."""
    return None if not values else values[0] if len(values) == 1 else tuple(values)


class Stepping:
    """One client's control of the steps. As in CoppeliaSim, what is switched on twice has to be switched off twice."""

    def __init__(self) -> None:
        """Let the simulation run."""
        self.level = 0
        self.locks = 0
        self._waits: list[Until] = []

    def set(self, enabled: bool) -> int:
        """Raise or lower the level (above 0, each step waits for this client); return the level from before."""
        before = self.level
        self.level = before + 1 if enabled else max(0, before - 1)
        return before

    def lock(self, more: int) -> None:
        """Let the simulation stand as long as there are locks."""
        self.locks = max(0, self.locks + more)

    def wait(self, until: Until) -> Until:
        """Let the simulation go on until then; return what to wait for."""
        self._waits = [one for one in self._waits if not one.over()]
        self._waits.append(until)
        return until

    def let_go(self) -> None:
        """Let the simulation run, whatever was said before."""
        self.level = self.locks = 0

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait for this client."""
        return bool(self.locks or (self.level and all(one.over() for one in self._waits)))


class RemoteApi:
    """Remote clients, which may delay the steps of the simulation. This base class has none; servers derive from it."""

    address = ""

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait."""
        return False

    def wait(self, seconds: float) -> None:
        """Sleep for so long, or until somebody has been heard."""
        time.sleep(seconds)

    def serve(self) -> None:
        """Hear whoever has come by now."""

    def wake(self) -> None:
        """End a `wait`; any thread may call it."""

    def close(self) -> None:
        """Let go of everybody."""
