"""`sim`: signals, values under a name that one script leaves for another, or for itself."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.calls import Function, WrongValue
from drone_sim.scripting.api.script_values import MOST_BYTES
from drone_sim.scripting.api.types import Name, Number, Text

_MOST = 10_000  # signals of a kind
_LONGEST_NAME = 200  # characters
_LARGEST = 2**31 - 1


class Signals:
    """Float, integer and string signals; a name may be used once for each kind."""

    def __init__(self) -> None:
        """Start with none."""
        self._values: dict[type[Any], dict[str, Any]] = {float: {}, int: {}, str: {}}

    def remember(self) -> Callable[[], None]:
        """Return a function that brings the present signals back."""
        kept = copy.deepcopy(self._values)

        def recall() -> None:
            self._values = copy.deepcopy(kept)

        return recall

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        return {name: getattr(self, name) for name in dir(self) if name.endswith("Signal")}

    def setFloatSignal(self, name: Name, value: Number) -> None:
        """Set a number."""
        self._set(float, name, float(value))

    def getFloatSignal(self, name: Name) -> float | None:
        """Return a number, or nothing where it is not set."""
        return self._values[float].get(name)

    def clearFloatSignal(self, name: Name | None = None) -> None:
        """Forget a number, or all of them."""
        self._clear(float, name)

    setDoubleSignal, getDoubleSignal, clearDoubleSignal = setFloatSignal, getFloatSignal, clearFloatSignal

    def setInt32Signal(self, name: Name, value: int) -> None:
        """Set a whole number."""
        if not abs(value) <= _LARGEST:  # so written, it refuses NaN
            raise WrongValue(f"a whole number within +-{_LARGEST} is expected")
        self._set(int, name, int(value))

    def getInt32Signal(self, name: Name) -> int | None:
        """Return a whole number, or nothing where it is not set."""
        return self._values[int].get(name)

    def clearInt32Signal(self, name: Name | None = None) -> None:
        """Forget a whole number, or all of them."""
        self._clear(int, name)

    setIntegerSignal, getIntegerSignal, clearIntegerSignal = setInt32Signal, getInt32Signal, clearInt32Signal

    def setStringSignal(self, name: Name, value: Text) -> None:
        """Set a string."""
        if not isinstance(value, (str, bytes)):
            raise WrongValue("a string is expected")
        before = self._values[str].get(name, "")
        size = sum(map(len, self._values[str].values())) - len(before) + len(value)
        if size > MOST_BYTES:
            raise ValueError(f"string signals may hold {MOST_BYTES} bytes together, not {size}")
        self._set(str, name, value)

    def getStringSignal(self, name: Name) -> str | None:
        """Return a string, or nothing where it is not set."""
        return self._values[str].get(name)

    def clearStringSignal(self, name: Name | None = None) -> None:
        """Forget a string, or all of them."""
        self._clear(str, name)

    def _set(self, kind: type[Any], name: str, value: Any) -> None:
        if not isinstance(name, str):
            raise WrongValue("the name of a signal is a string")
        if len(name) > _LONGEST_NAME:
            raise ValueError(f"the name of a signal has at most {_LONGEST_NAME} characters, not {len(name)}")
        values = self._values[kind]
        if name not in values and len(values) >= _MOST:
            raise ValueError(f"{_MOST} signals of a kind are there already: clear some")
        values[name] = value

    def _clear(self, kind: type[Any], name: str | None) -> None:
        if name is None:
            self._values[kind].clear()
        else:
            self._values[kind].pop(name, None)
