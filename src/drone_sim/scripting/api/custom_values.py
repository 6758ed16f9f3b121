"""Values that scripts leave on objects, by name."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.script_values import MOST_BYTES, refuse_if_too_large

_MOST = 10_000  # values of all objects
_LONGEST_NAME = 200  # characters


class CustomData:
    """Values by object and name, for the scripts of all vehicles."""

    def __init__(self) -> None:
        """Start with none."""
        self.values: dict[tuple[int, str], Any] = {}

    def remember(self) -> Callable[[], None]:
        """Return a function that brings the present values back."""
        kept = copy.deepcopy(self.values)

        def recall() -> None:
            self.values = copy.deepcopy(kept)

        return recall

    def set(self, handle: int, name: str, value: Any) -> None:
        """Keep a value, or forget it where it is None or ''. Raises WrongValue, ValueError."""
        if not isinstance(name, str):
            raise WrongValue("the name of a value is a string")
        if len(name) > _LONGEST_NAME:
            raise ValueError(f"the name of a value has at most {_LONGEST_NAME} characters, not {len(name)}")
        refuse_if_too_large(value)
        if value is None or (isinstance(value, (str, bytes)) and not value):
            self.values.pop((handle, name), None)
            return
        if (handle, name) not in self.values and len(self.values) >= _MOST:
            raise ValueError(f"{_MOST} values are there already: forget some")
        size = sum(len(one) for one in self.values.values() if isinstance(one, (str, bytes)))
        if isinstance(value, (str, bytes)) and size + len(value) > MOST_BYTES:
            raise ValueError(f"custom data may hold {MOST_BYTES} bytes together")
        self.values[handle, name] = copy.deepcopy(value)

    def names(self, handle: int) -> list[str]:
        """Return the names of an object's values."""
        return [name for one, name in self.values if one == handle]
