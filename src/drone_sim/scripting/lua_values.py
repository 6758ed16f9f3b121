"""Values on their way between Python and Lua: tables are 1-based in Lua, lists in Python.

Strings of Lua arrive as str, or as bytes where they are no UTF-8 (images). A tuple of several results
becomes several values; a message object becomes a table of its fields.
"""

from __future__ import annotations

from numbers import Real
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

_DEEPEST = 16  # levels of nested tables
_ON_STACK = 200  # values that a Lua call takes at once


class Values:
    """Converts for one Lua state. `close` lets go of it: Python cannot see a cycle that leads through Lua."""

    def __init__(self, runtime: Any, lua_type: Callable[[Any], Optional[str]]):
        """Take lupa's runtime, and its lua_type."""
        self._runtime = runtime
        self._lua_type = lua_type
        self._table = type(runtime.table())
        self._list: Any = None
        self._items: Any = None
        self._callback_number: Any = None

    def use(self, sandbox: Any) -> None:
        """Take the sandbox's helpers."""
        self._list, self._items = sandbox[b"list"], sandbox[b"items"]
        self._callback_number = sandbox[b"callback_number"]

    def close(self) -> None:
        """Let go of the Lua state."""
        self._runtime = self._list = self._items = self._callback_number = None

    # ---- to Python

    def arguments(self, values: Tuple[Any, ...]) -> List[Any]:
        """Return a Lua call's arguments; nil at the end is as good as left out."""
        found = [value if type(value) in _NUMBERS else self.to_python(value) for value in values]
        while found and found[-1] is None:
            found.pop()
        return found

    def to_python(self, value: Any, depth: int = 0) -> Any:
        """Return a Lua value; raises TypeError for what Python has no counterpart of."""
        if type(value) is self._table:
            return self._from_table(value, depth)
        if isinstance(value, bytes):
            return _text(value)
        kind = self._lua_type(value)
        if kind is None:
            return value
        if kind == "function":
            return self._callback_number(value)
        raise TypeError(f"a {kind} cannot be handed over")

    def _from_table(self, table: Any, depth: int) -> Any:
        if depth >= _DEEPEST:
            raise ValueError("a table is nested too deeply")
        count = len(table)
        if not count:
            named = {self.to_python(key): self.to_python(value, depth + 1) for key, value in table.items()}
            return named or []
        if count == 1:
            values: Sequence[Any] = (table[1],)
        elif count <= _ON_STACK:
            values = self._items(table)
        else:
            values = [table[index] for index in range(1, count + 1)]
        if all(map(_NUMBERS.__contains__, map(type, values))):
            return list(values)
        return [self.to_python(value, depth + 1) for value in values]

    # ---- to Lua

    def results(self, value: Any) -> Tuple[Any, ...]:
        """Return what a Python function gave as the values of a Lua call."""
        if type(value) is tuple:
            return tuple(map(self.to_lua, value))
        return () if value is None else (self.to_lua(value),)

    def to_lua(self, value: Any) -> Any:
        """Return a value as Lua takes it: scalars as they are, everything else as a table."""
        if value is None or type(value) in _NUMBERS or isinstance(value, bytes):
            return value
        if type(value) is list:
            return self._to_table(value)
        if isinstance(value, str):
            return value.encode("utf-8")
        return self._object_to_lua(value)

    def _object_to_lua(self, value: Any) -> Any:
        if isinstance(value, Real):
            return float(value)
        if hasattr(value, "to_sec"):  # ROS's times
            return value.to_sec()
        if isinstance(value, bytearray):
            return bytes(value)
        fields = _fields(value)
        if fields is None:
            return self._to_table(list(value))
        return self._runtime.table_from({self.to_lua(key): self.to_lua(item) for key, item in fields.items()})

    def _to_table(self, value: List[Any]) -> Any:
        values = value if all(map(_NUMBERS.__contains__, map(type, value))) else [self.to_lua(item) for item in value]
        return self._list(*values) if len(values) <= _ON_STACK else self._runtime.table_from(values)


_NUMBERS = frozenset((float, int, bool))


def _text(value: bytes) -> Any:
    try:
        return value.decode("utf-8")
    except UnicodeDecodeError:
        return value


def _fields(value: Any) -> Optional[Mapping[str, Any]]:
    """Return the named fields of a mapping or message object; None for a sequence."""
    if isinstance(value, Mapping):
        return value
    names = getattr(value, "_fields", None) or getattr(value, "__slots__", None)
    if names is not None:
        return {name: getattr(value, name) for name in names if not name.startswith("_")}
    own: Optional[Dict[str, Any]] = getattr(value, "__dict__", None)
    return own if own is not None and not hasattr(value, "__iter__") else None
