"""Values on their way between Python and Lua: tables are 1-based in Lua, lists in Python.

Strings of Lua arrive as str, or as bytes where they are no UTF-8 (images). A tuple of several results
becomes several values; a message object becomes a table of its fields.
"""

from __future__ import annotations

from numbers import Real
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from drone_sim.scripting.script_values import DEEPEST, MOST_BYTES, MOST_VALUES, refuse_if_too_large

_ON_STACK = 200  # values that a Lua call takes at once
_NUMBERS = frozenset((float, int, bool))
ALL_NUMBERS = _NUMBERS.issuperset
_LARGEST = 2**63  # whole numbers beyond are floats in Lua

# How the values of an answer to Lua are read there (lua_crossing.py).
FAILED, PLAIN, LIST, TWO_LISTS, AS_STREAM = range(5)
# How a call's arguments come: with lists, or as a stream.
_SCALARS, _FIRST, _SECOND, _THIRD, _FIRST_AND_SECOND, _SECOND_AND_THIRD, _STREAM = range(7)


_NOTHING = (PLAIN,)


class _Mark:
    """A mark in a stream of values: where a table begins or ends."""


_OPEN_LIST, _OPEN_FIELDS, _CLOSE = _Mark(), _Mark(), _Mark()


class Values:
    """Converts for one Lua state. `close` lets go of it: Python cannot see a cycle that leads through Lua."""

    def __init__(self, runtime: Any):
        """Take lupa's runtime."""
        self._runtime = runtime
        self._stream: List[Any] = []

    def close(self) -> None:
        """Let go of the Lua state."""
        self._runtime = None

    def bridge(self) -> Dict[str, Any]:
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

    def arguments(self, how: int, given: Tuple[Any, ...]) -> Optional[Sequence[Any]]:
        """Return a Lua call's arguments; nil at the end is as good as left out.

        None where the lists hold other things than numbers, and the call is to be made anew, with a stream.
        """
        if how == _SCALARS:
            found: List[Any] = [value if type(value) in _NUMBERS else _text(value) for value in given]
        elif how == _STREAM:
            found, self._stream = _from_stream(self._stream), []
        else:
            found = _with_lists(how, given)
            if not found:
                return None
        while found and found[-1] is None:
            found.pop()
        return found

    # ---- to Lua

    def results(self, value: Any) -> Tuple[Any, ...]:
        """Return what a Python function gave as an answer to Lua; raises ValueError for too much of it."""
        kind = type(value)
        if kind is list and len(value) <= _ON_STACK and ALL_NUMBERS(map(type, value)):
            return (LIST, *value)
        if value is None:
            return _NOTHING
        if kind is float or kind is bool:
            return (PLAIN, value)
        if kind is not tuple:
            return (PLAIN, self.to_lua(value))
        if _are_two_vectors(value):
            return (TWO_LISTS, *value[0], *value[1])
        return (PLAIN, *self.to_lua(list(value), unpacked=True))

    def to_lua(self, value: Any, unpacked: bool = False) -> Any:
        """Return a value as Lua takes it: scalars as they are, everything else as a table.

        `unpacked` is for a list: its items, each so. Raises ValueError for a value that is too large.
        """
        refuse_if_too_large(value, fields)
        return [self._to_lua(item) for item in value] if unpacked else self._to_lua(value)

    def _to_lua(self, value: Any) -> Any:
        kind = type(value)
        if kind is int:
            return value if -_LARGEST <= value < _LARGEST else _as_float(value)
        if value is None or kind in _NUMBERS or isinstance(value, bytes):
            return value
        if isinstance(value, str):
            return value.encode("utf-8", "replace")
        if isinstance(value, Real):
            return float(value)
        if hasattr(value, "to_sec"):  # ROS's times
            return value.to_sec()
        if isinstance(value, (bytearray, memoryview)):
            return bytes(value)
        named = fields(value)
        if named is None:
            return self._runtime.table_from([self._to_lua(item) for item in value])
        return self._runtime.table_from({self._key(key): self._to_lua(item) for key, item in named.items()})

    def _key(self, key: Any) -> Any:
        if key is None or key != key:
            raise ValueError(f"{key} cannot be a key")
        return self._to_lua(key)


def _with_lists(how: int, given: Tuple[Any, ...]) -> List[Any]:
    """Return the arguments; [] where the lists hold other things than numbers."""
    if how < _FIRST_AND_SECOND:
        one, other, *values = given
        if not ALL_NUMBERS(map(type, values)):
            return []
        if how == _THIRD:
            return [one, other, values]
        return [one, values, other] if how == _SECOND else [values, one, other]
    if how == _FIRST_AND_SECOND:
        x, y, z, *values = given
        return [values, [x, y, z]] if ALL_NUMBERS(map(type, given)) else []
    first, x, y, z, *values = given
    return [first, [x, y, z], values] if ALL_NUMBERS(map(type, given[1:])) else []


def _from_stream(tokens: List[Any]) -> List[Any]:
    outer: List[List[Any]] = []
    here: List[Any] = []
    marks: List[Any] = []
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


def _are_two_vectors(value: Tuple[Any, ...]) -> bool:
    if len(value) != 2 or type(value[0]) is not list or type(value[1]) is not list:
        return False
    return len(value[0]) == 3 == len(value[1]) and ALL_NUMBERS(map(type, (*value[0], *value[1])))


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


def fields(value: Any) -> Optional[Mapping[Any, Any]]:
    """Return the named fields of a mapping or message object; None for a sequence."""
    if isinstance(value, Mapping):
        return value
    names = getattr(value, "_fields", None) or getattr(value, "__slots__", None)
    if names is not None:
        return {name: getattr(value, name) for name in names if not name.startswith("_")}
    own: Optional[Dict[str, Any]] = getattr(value, "__dict__", None)
    return own if own is not None and not hasattr(value, "__iter__") else None
