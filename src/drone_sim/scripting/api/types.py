"""Types of the API's arguments, with the names for error messages: 'expected (handle: Handle, position: ...)'.

Also, conversion of numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any

Handle = int
Name = str
Text = str
Number = float
Numbers = Sequence[float]
ThreeNumbers = Sequence[float]
FourNumbers = Sequence[float]
SevenNumbers = Sequence[float]
TwelveNumbers = Sequence[float]
Callback = str | Callable[[Any], Any]


class WrongValue(TypeError):
    """A value of the wrong type; the message says what is expected."""


def written(value: Any) -> Any:
    """Return a number as text with up to 14 digits, like Lua where a string is expected; other values unchanged."""
    if type(value) in (int, float):
        return str(value) if type(value) is int else f"{value:.14g}"
    return value


def numbers(values: Sequence[float], count: int) -> tuple[float, ...]:
    """Return `count` finite numbers. Raises WrongValue."""
    if type(values) is list and len(values) == count:  # fast path for a list that another call has returned
        try:
            total = sum(values)
        except TypeError:
            total = None
        if type(total) is float and isfinite(total):
            return tuple(values)
    expected = f"{count} numbers are expected" if count != 1 else "a number is expected"
    try:
        found = tuple(map(float, values))
    except OverflowError:  # an integer that is too large for a float
        raise WrongValue("finite numbers are expected") from None
    except (TypeError, ValueError):
        raise WrongValue(expected) from None
    if len(found) != count:
        raise WrongValue(f"{expected}, not {len(found)}")
    if not isfinite(sum(found)):
        raise WrongValue("finite numbers are expected")
    return found
