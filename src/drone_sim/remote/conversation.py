"""What a request may have to wait for before it has its answer: a task is a generator that yields these.

    values = yield Call("on_message", [message])     the client calls a function of its own
    yield Until(lambda: simulation.steps > steps)    the simulation goes on

and returns the list of values that the client gets.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, NamedTuple


class Call(NamedTuple):
    """A function of the client's, by name."""

    function: str
    arguments: list[Any]


class Until(NamedTuple):
    """Something that comes true by and by, without the client."""

    over: Callable[[], bool]


class Refused(Exception):
    """What a client asked for cannot be done; one line that says why, which the client raises."""


Task = Generator[Call | Until, Any, Any]


class ClientFunction:
    """A function of a client's, as the API gets it: a name that is kept until the client asks for something."""

    def __init__(self, name: str):
        """Take the name that the client knows it by."""
        self.name = name

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: where a function has to return at once, nobody can ask a client."""
        raise ValueError("a function of a client outside cannot be called from here")


def returned(values: list[Any]) -> Any:
    """Return what a client's function has returned: nothing, one value, or several."""
    return None if not values else values[0] if len(values) == 1 else tuple(values)
