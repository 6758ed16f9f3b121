"""Conversion of values between Python and Lua.

Lua's tables, with indices from 1, become lists. Lua's strings become str, or bytes if they are not UTF-8 (images). In
Lua, a tuple of results becomes several values, and a message object a table of its fields.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

from drone_sim.scripting.api.types import DEEPEST, MOST_BYTES, MOST_VALUES, refuse_if_too_large

_NUMBERS = frozenset((float, int, bool))
_ALL_NUMBERS = _NUMBERS.issuperset
_ALL_FLOATS = frozenset((float,)).issuperset
_LARGEST = 2**63  # integers beyond are converted to floats for Lua

# How Lua decodes the values of a result (values.lua).
FAILED, PLAIN, LIST, TWO_LISTS, AS_STREAM, TOO_MUCH = range(6)


# Encoders of the most frequent results, by the functions' annotations.
_ENCODERS: dict[Any, Callable[[Any], tuple[Any, ...]]] = {
    "None": lambda _: (PLAIN,),
    "float": lambda value: (PLAIN, value),
    "list[float]": lambda values: (LIST, *values),
    "list[int]": lambda values: (LIST, *values),
    "tuple[list[float], list[float]]": lambda values: (TWO_LISTS, *values[0], *values[1]),
}


class _Mark:
    """A mark in a stream of values, at the beginning or end of a table."""


_OPEN_LIST, _OPEN_FIELDS, _CLOSE = _Mark(), _Mark(), _Mark()


class Values:
    """Converter for one Lua state."""

    def __init__(self, table_from: Callable[[Any], Any]):
        """`table_from` creates a Lua table, as in lupa's LuaRuntime."""
        self._table_from = table_from
        self._stream: list[Any] = []

    def close(self) -> None:
        """Drop the reference to the Lua state."""
        self._table_from = list  # any function without a reference to it

    def bridge(self) -> dict[str, Any]:
        """Return the functions and limits that values.lua needs."""
        return {
            "fresh": self._fresh,
            "put": self._put,
            "open_list": _OPEN_LIST,
            "open_fields": _OPEN_FIELDS,
            "close": _CLOSE,
            "deepest": DEEPEST,
            "most_values": MOST_VALUES,
            "most_bytes": MOST_BYTES,
        }

    # ---- to Python

    def _fresh(self) -> None:
        self._stream = []

    def _put(self, *values: Any) -> None:
        self._stream.extend(values)

    def returned(self) -> Any:
        """Return the results of a Lua function, which Lua has put into the stream: None, a value, or a tuple."""
        values = self._from_stream(())
        return tuple(values) if len(values) > 1 else values[0] if values else None

    def _from_stream(self, _values: tuple[Any, ...]) -> list[Any]:
        values, self._stream = _from_stream(self._stream), []
        while values and values[-1] is None:  # a nil at the end is the same as a missing value
            values.pop()
        return values

    def readers(self) -> Sequence[Callable[[tuple[Any, ...]], Sequence[Any] | None]]:
        """Return, for each form of a call, the function that decodes the arguments from Lua.

        It returns None if a list contains anything but numbers; then Lua repeats the call with a stream.
        """
        return tuple, _scalars, _one_list, _first_and_second, _second_and_third, self._from_stream

    # ---- to Lua

    def encoder_of(self, function: Callable[..., Any]) -> Callable[[Any], tuple[Any, ...]]:
        """Return the function that encodes a function's results for Lua, by its annotation.

        It raises ValueError for results that are too large.
        """
        returns = function.__annotations__.get("return", "")
        if returns == "VisionReading":
            return lambda packets: self._results(tuple(packet for packet in packets if packet != ()))
        return _ENCODERS.get(returns, self._results)

    def _results(self, value: Any) -> tuple[Any, ...]:
        if type(value) is not tuple:
            return (PLAIN,) if value is None else (PLAIN, self.to_lua(value))
        return (PLAIN, *self.to_lua(list(value), unpacked=True))

    def to_lua(self, value: Any, unpacked: bool = False) -> Any:
        """Return a value for Lua: scalars unchanged, everything else as a table.

        `unpacked`: return a list with each item converted. Raises ValueError for a value that is too large.
        """
        refuse_if_too_large(value, fields)
        return [self._to_lua(item) for item in value] if unpacked else self._to_lua(value)

    def _to_lua(self, value: Any) -> Any:
        if type(value) is int:
            return value if -_LARGEST <= value < _LARGEST else _as_float(value)
        if value is None or isinstance(value, (float, bool, bytes)):
            return value
        if isinstance(value, str):
            return value.encode("utf-8", "replace")
        if isinstance(value, Real):
            return float(value)
        return value.to_sec() if hasattr(value, "to_sec") else self._table(value)  # times of ROS

    def _table(self, value: Any) -> Any:
        if isinstance(value, (bytearray, memoryview)):
            return bytes(value)
        named = fields(value)
        if named is None:
            floats = type(value) is list and _ALL_FLOATS(map(type, value))  # as in images, which are long
            return self._table_from(value if floats else [self._to_lua(item) for item in value])
        return self._table_from({self._key(key): self._to_lua(item) for key, item in named.items()})

    def _key(self, key: Any) -> Any:
        if key is None or key != key:
            raise ValueError(f"{key} cannot be a key")
        return self._to_lua(key)


def _scalars(values: tuple[Any, ...]) -> list[Any]:
    return [_text(value) if type(value) is bytes else value for value in values]


def _one_list(values: tuple[Any, ...]) -> list[Any] | None:
    """Decode a list and two scalars, which may be None; the first value is the list's index among the three."""
    index, first, second, *numbers = values
    if not _ALL_NUMBERS(map(type, numbers)):
        return None
    arguments = [first, second]
    arguments.insert(index, numbers)
    while arguments[-1] is None:
        arguments.pop()
    return arguments


def _first_and_second(values: tuple[Any, ...]) -> list[Any] | None:
    return [[*values[3:]], [*values[:3]]] if _ALL_NUMBERS(map(type, values)) else None


def _second_and_third(values: tuple[Any, ...]) -> list[Any] | None:
    first, x, y, z, *numbers = values
    return [first, [x, y, z], numbers] if _ALL_NUMBERS(map(type, values[1:])) else None


def _from_stream(tokens: list[Any]) -> list[Any]:
    outer: list[list[Any]] = []
    current: list[Any] = []
    marks: list[Any] = []
    for token in tokens:
        if type(token) in _NUMBERS:
            current.append(token)
        elif token is _CLOSE:
            table: Any = current
            if marks.pop() is _OPEN_FIELDS:
                table = dict(zip(current[::2], current[1::2])) or []
            current = outer.pop()
            current.append(table)
        elif type(token) is _Mark:
            outer.append(current)
            marks.append(token)
            current = []
        else:
            current.append(_text(token))
    return current


def _text(value: Any) -> Any:
    if type(value) is not bytes:
        return value
    try:
        return value.decode("utf-8")
    except UnicodeDecodeError:
        return value


def _as_float(value: int) -> float:
    try:
        return float(value)
    except OverflowError:
        raise ValueError("a whole number is too large") from None


def fields(value: Any) -> Mapping[Any, Any] | None:
    """Return the fields of a mapping or message object by name; None for a sequence."""
    if isinstance(value, Mapping):
        return value
    names = getattr(value, "_fields", None) or getattr(value, "__slots__", None)
    if names is not None:
        return {name: getattr(value, name) for name in names if not name.startswith("_")}
    own: dict[str, Any] | None = getattr(value, "__dict__", None)
    return own if own is not None and not hasattr(value, "__iter__") else None
