"""Transfer of functions and errors between the processes: functions as numbers, errors as class names."""

from __future__ import annotations

from typing import Any

from drone_sim.scripting.api.calls import UnknownName
from drone_sim.scripting.api.control import NoThread
from drone_sim.scripting.api.types import WrongValue

ERRORS: dict[str, Any] = {
    error.__name__: error
    for error in (
        *(TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError, ZeroDivisionError, RuntimeError),
        *(OSError, RecursionError, MemoryError, WrongValue, UnknownName, NoThread),
    )
}


def kind_of(error: Exception) -> str:
    """Return the name of an error's class, or of its nearest base class in ERRORS."""
    return next((base.__name__ for base in type(error).__mro__ if base.__name__ in ERRORS), RuntimeError.__name__)


class ScriptFunction:
    """A function in a script's process, identified by a number; it can be passed on, but not called here."""

    def __init__(self, number: int):
        """Use the number that the function has in the script's process."""
        self.number = number
        self.__name__ = "callback"

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: a function whose result is needed at once cannot be called in another process."""
        raise ValueError("a function of the script cannot be called from here")
