"""Types, conversion and size limits of values from scripts.

Error messages show the types' names: 'expected (handle: Handle, position: ...)'.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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

DEEPEST = 16  # levels of nested tables, lists and mappings
MOST_VALUES = 3 * 2048 * 2048  # in one call or message, as in the largest picture of a vision sensor
MOST_BYTES = 64 * 1024 * 1024  # of all strings in it
_LONGEST_NAME = 200  # characters

_PLAIN = frozenset((float, int, bool, type(None)))
_STRINGS = (str, bytes, bytearray, memoryview)
Fields = Callable[[Any], Mapping[Any, Any] | None]


class WrongValue(TypeError):
    """A value of the wrong type; the message says what is expected."""


def written(value: Any) -> Any:
    """Return a number as text with up to 14 digits, like Lua where a string is expected; other values unchanged."""
    if type(value) in (int, float):
        return str(value) if type(value) is int else f"{value:.14g}"
    return value


def check_name(name: Any, owner: str) -> None:
    """Raise WrongValue if a name is not a string, ValueError if it is too long; `owner` is for the message."""
    if not isinstance(name, str):
        raise WrongValue(f"the name of {owner} must be a string")
    if len(name) > _LONGEST_NAME:
        raise ValueError(f"the name of {owner} must have at most {_LONGEST_NAME} characters, not {len(name)}")


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


def refuse_if_too_large(
    value: Any, fields: Fields = lambda value: value if isinstance(value, Mapping) else None
) -> None:
    """Raise ValueError for a value from a script that is too large, nested too deeply, or contains itself.

    Lists, tuples and mappings are searched, and objects for which `fields` returns a mapping.
    """
    if type(value) in _PLAIN:
        return
    count = size = 0
    waiting: list[tuple[Any, int]] = [(value, 0)]
    while waiting:
        value, depth = waiting.pop()
        if isinstance(value, _STRINGS):
            size += len(value)
            if size > MOST_BYTES:
                raise ValueError(f"more than {MOST_BYTES} bytes cannot be passed")
            continue
        inner = _inner(value, fields)
        if inner is None:
            continue
        if depth >= DEEPEST:
            raise ValueError(f"a table is nested too deeply: at most {DEEPEST} levels are allowed")
        count += len(inner)
        if count > MOST_VALUES:
            raise ValueError(f"more than {MOST_VALUES} values are too many")
        if not _PLAIN.issuperset(map(type, inner)):  # fast for images with millions of values
            waiting.extend((item, depth + 1) for item in inner if type(item) not in _PLAIN)


def _inner(value: Any, fields: Fields) -> list[Any] | None:
    named = fields(value)
    if named is not None:
        return [*named.keys(), *named.values()]
    if not hasattr(value, "__len__") or not hasattr(value, "__iter__"):
        return None
    if len(value) > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES} values are too many")
    return list(value)
