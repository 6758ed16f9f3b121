"""What the API's functions take, by the names that messages call it: 'expected (handle: Handle, position: ...)'.

And how numbers are read.
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
    """A value is of the wrong kind; the message says what is expected instead."""


def written(value: Any) -> Any:
    """Return a number written out, with up to 14 digits, as Lua takes it where a string is expected; else the value."""
    if type(value) in (int, float):
        return str(value) if type(value) is int else f"{value:.14g}"
    return value


def numbers(values: Sequence[float], count: int) -> tuple[float, ...]:
    """Return `count` finite numbers; raises WrongValue."""
    if type(values) is list and len(values) == count:  # most often what another call returned
        try:
            total = sum(values)
        except TypeError:
            total = None
        if type(total) is float and isfinite(total):
            return tuple(values)
    expected = f"{count} numbers are expected" if count != 1 else "a number is expected"
    try:
        found = tuple(map(float, values))
    except OverflowError:  # a whole number beyond all floats
        raise WrongValue("finite numbers are expected") from None
    except (TypeError, ValueError):
        raise WrongValue(expected) from None
    if len(found) != count:
        raise WrongValue(f"{expected}, not {len(found)}")
    if not isfinite(sum(found)):
        raise WrongValue("finite numbers are expected")
    return found
