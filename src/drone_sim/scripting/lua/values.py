"""Values on their way between Python and Lua: tables are 1-based in Lua, lists in Python.

Strings of Lua arrive as str, or as bytes where they are no UTF-8 (images). A tuple of several results
becomes several values; a message object becomes a table of its fields.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

from drone_sim.scripting.api.script_values import DEEPEST, MOST_BYTES, MOST_VALUES, refuse_if_too_large

_NUMBERS = frozenset((float, int, bool))
_ALL_NUMBERS = _NUMBERS.issuperset
_ALL_FLOATS = frozenset((float,)).issuperset
_LARGEST = 2**63  # whole numbers beyond are floats in Lua

# How the values of an answer to Lua are read there (values.lua).
FAILED, PLAIN, LIST, TWO_LISTS, AS_STREAM, TOO_MUCH = range(6)


# What functions of the API return, most often, and the answer that it is.
_ANSWERS: dict[Any, Callable[[Any], tuple[Any, ...]]] = {
    "None": lambda _: (PLAIN,),
    "float": lambda value: (PLAIN, value),
    "list[float]": lambda values: (LIST, *values),
    "list[int]": lambda values: (LIST, *values),
    "tuple[list[float], list[float]]": lambda values: (TWO_LISTS, *values[0], *values[1]),
}


class _Mark:
    """A mark in a stream of values: where a table begins or ends."""


_OPEN_LIST, _OPEN_FIELDS, _CLOSE = _Mark(), _Mark(), _Mark()


class Values:
    """Converts for one Lua state, of which `close` lets go."""

    def __init__(self, table_from: Callable[[Any], Any]):
        """`table_from` makes a table of Lua's, as lupa's runtime does."""
        self._table_from = table_from
        self._stream: list[Any] = []

    def close(self) -> None:
        """Let go of the Lua state."""
        self._table_from = list  # anything that leads to no state

    def bridge(self) -> dict[str, Any]:
        """Return what the Lua side needs for handing values over."""
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

    def handed_back(self) -> Any:
        """Return what a function has handed over: None, a value, or a tuple of several."""
        found = self._from_stream(())
        return tuple(found) if len(found) > 1 else found[0] if found else None

    def _from_stream(self, _given: tuple[Any, ...]) -> list[Any]:
        found, self._stream = _from_stream(self._stream), []
        while found and found[-1] is None:  # nil at the end is as good as left out
            found.pop()
        return found

    def readers(self) -> Sequence[Callable[[tuple[Any, ...]], Sequence[Any] | None]]:
        """Return, for each form of a call, the function that makes the arguments from what Lua has handed over.

        It returns None if a list contains anything but numbers: then the call is repeated with a stream.
        """
        return tuple, _scalars, _one_list, _first_and_second, _second_and_third, self._from_stream

    # ---- to Lua

    def answer_of(self, function: Callable[..., Any]) -> Callable[[Any], tuple[Any, ...]]:
        """Return what turns a function's results into an answer to Lua, by what it is annotated to return.

        The answer raises ValueError for too much.
        """
        returns = function.__annotations__.get("return", "")
        if returns == "VisionReading":
            return lambda packets: self._results(tuple(one for one in packets if one != ()))
        return _ANSWERS.get(returns, self._results)

    def _results(self, value: Any) -> tuple[Any, ...]:
        if type(value) is not tuple:
            return (PLAIN,) if value is None else (PLAIN, self.to_lua(value))
        return (PLAIN, *self.to_lua(list(value), unpacked=True))

    def to_lua(self, value: Any, unpacked: bool = False) -> Any:
        """Return a value as Lua takes it: scalars as they are, everything else as a table.

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
        return value.to_sec() if hasattr(value, "to_sec") else self._table(value)  # ROS's times

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


def _scalars(given: tuple[Any, ...]) -> list[Any]:
    return [_text(value) if type(value) is bytes else value for value in given]


def _one_list(given: tuple[Any, ...]) -> list[Any] | None:
    """Read a list, and two values that may be missing: first at which place it comes."""
    place, one, other, *numbers = given
    if not _ALL_NUMBERS(map(type, numbers)):
        return None
    found = [one, other]
    found.insert(place, numbers)
    while found[-1] is None:
        found.pop()
    return found


def _first_and_second(given: tuple[Any, ...]) -> list[Any] | None:
    return [[*given[3:]], [*given[:3]]] if _ALL_NUMBERS(map(type, given)) else None


def _second_and_third(given: tuple[Any, ...]) -> list[Any] | None:
    first, x, y, z, *values = given
    return [first, [x, y, z], values] if _ALL_NUMBERS(map(type, given[1:])) else None


def _from_stream(tokens: list[Any]) -> list[Any]:
    outer: list[list[Any]] = []
    here: list[Any] = []
    marks: list[Any] = []
    for token in tokens:
        if type(token) in _NUMBERS:
            here.append(token)
        elif token is _CLOSE:
            made: Any = here
            if marks.pop() is _OPEN_FIELDS:
                made = dict(zip(here[::2], here[1::2])) or []
            here = outer.pop()
            here.append(made)
        elif type(token) is _Mark:
            outer.append(here)
            marks.append(token)
            here = []
        else:
            here.append(_text(token))
    return here


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
    """Return the named fields of a mapping or message object; None for a sequence."""
    if isinstance(value, Mapping):
        return value
    names = getattr(value, "_fields", None) or getattr(value, "__slots__", None)
    if names is not None:
        return {name: getattr(value, name) for name in names if not name.startswith("_")}
    own: dict[str, Any] | None = getattr(value, "__dict__", None)
    return own if own is not None and not hasattr(value, "__iter__") else None
