"""Functions and errors: they are no plain values, so they go through the door as a number or a name."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.calls import UnknownName
from drone_sim.scripting.api.control import NoThread
from drone_sim.scripting.api.types import WrongValue

ERRORS: dict[str, Any] = {
    one.__name__: one
    for one in (
        *(TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError, ZeroDivisionError, RuntimeError),
        *(OSError, RecursionError, MemoryError, WrongValue, UnknownName, NoThread),
    )
}


def kind_of(error: Exception) -> str:
    """Return the name of an error's class, or the next one above it that is known on either side."""
    return next((one.__name__ for one in type(error).__mro__ if one.__name__ in ERRORS), RuntimeError.__name__)


class ScriptFunction:
    """A function of a script in another process, by the number that it has there: to be handed back, not called."""

    def __init__(self, number: int):
        """Take the number."""
        self.number = number
        self.__name__ = "callback"

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: a function that has to return at once cannot be called in another process."""
        raise ValueError("a function of the script cannot be called from here")
