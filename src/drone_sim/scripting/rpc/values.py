"""Encoding of values in messages between the processes.

Messages to the script are written by `marshal`, because the script can trust the simulation. Messages from the script
are JSON, which contains nothing but data. A JSON object is a mark, identified by its only key:

    {"t": [...]}  a tuple          {"d": [[key, value], ...]}  a mapping      {"b": "..."}  bytes, in base64
    {"f": 3}      a function       {"o": [[name, value], ...]}  an object with fields, such as a message
"""

from __future__ import annotations

import base64
import functools
import json
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from drone_sim.scripting.api.calls import UnknownName
from drone_sim.scripting.api.control import NoThread
from drone_sim.scripting.api.scripts import FunctionsOfScript, handle_of
from drone_sim.scripting.api.types import DEEPEST, WrongValue
from drone_sim.scripting.lua.values import fields

PLAIN = frozenset((float, int, bool, str, type(None)))
ALL_PLAIN = PLAIN.issuperset
_MARKS = {"b": str, "f": int, "t": list, "d": list, "o": list}
_MARSHALLED = frozenset((*PLAIN, bytes))
_ALL_MARSHALLED = _MARSHALLED.issuperset
_encode = json.JSONEncoder(check_circular=False, separators=(",", ":")).encode
_decode = json.JSONDecoder().raw_decode

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


class InvalidMessage(ValueError):
    """The script's process has sent an invalid message."""


class ScriptFunction:
    """A function in a script's process, identified by a number; it can be passed on, but not called here."""

    def __init__(self, number: int):
        """Use the number that the function has in the script's process."""
        self.number = number
        self.__name__ = "callback"

    def __call__(self, *_values: Any) -> Any:
        """Raise ValueError: a function whose result is needed at once cannot be called in another process."""
        raise ValueError("a function of the script cannot be called from here")


# ---- to the script


def outgoing(value: Any) -> Any:
    """Return a value of the API encoded for marshal: plain values unchanged, others as (mark, ...)."""
    kind = type(value)
    if kind in _MARSHALLED:
        return value
    if kind is list:
        return value if _ALL_MARSHALLED(map(type, value)) else [outgoing(item) for item in value]
    if kind is tuple:
        return ("tuple", *map(outgoing, value))
    if isinstance(value, Mapping):
        return ("mapping", [(outgoing(key), outgoing(item)) for key, item in value.items()])
    return _outgoing_object(value)


def _outgoing_object(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return outgoing(value.tolist())
    for kind, encode in _OUTGOING:
        if isinstance(value, kind):
            return encode(value)
    if hasattr(value, "to_sec"):
        return float(value.to_sec())
    by_name = fields(value)
    if by_name is None:
        return [outgoing(item) for item in value]
    is_tuple = isinstance(value, tuple)
    return "object", type(value).__name__, is_tuple, [(str(name), outgoing(item)) for name, item in by_name.items()]


_OUTGOING: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
    ((bytearray, memoryview), bytes),
    (FunctionsOfScript, lambda value: ("functions", handle_of(value))),
    (ScriptFunction, lambda value: ("function", value.number)),
    *((kind, kind) for kind in (str, bool, int, float)),  # subclasses of these
)


def incoming(value: Any, function: Callable[[int], Any], functions: Callable[[int], Any]) -> Any:
    """Return the value that `outgoing` has encoded; called in the script's process.

    `function` returns a function of the script by its number, `functions` the functions of the script with a handle.
    """
    kind = type(value)
    if kind is list:
        return value if _ALL_MARSHALLED(map(type, value)) else [incoming(item, function, functions) for item in value]
    if kind is not tuple:
        return value
    mark, *rest = value
    if mark == "tuple":
        return tuple([incoming(item, function, functions) for item in rest])
    if mark == "mapping":
        return {incoming(key, function, functions): incoming(item, function, functions) for key, item in rest[0]}
    if mark == "object":
        name, is_tuple, pairs = rest
        by_name = {key: incoming(item, function, functions) for key, item in pairs}
        return _class_of(name, tuple(by_name))(**by_name) if is_tuple else SimpleNamespace(**by_name)
    return (functions if mark == "functions" else function)(rest[0])


_class_of = functools.cache(namedtuple)


# ---- from the script


def marked(value: Any, number: Callable[[Any], int]) -> Any:
    """Return a value encoded for JSON; called in the script's process. Raises TypeError for unsupported values.

    `number` returns the number of a function.
    """
    kind = type(value)
    if kind in PLAIN:
        return value
    if kind is list:
        return value if ALL_PLAIN(map(type, value)) else [marked(item, number) for item in value]
    if kind is tuple:
        return {"t": [marked(item, number) for item in value]}
    if isinstance(value, Mapping):
        return {"d": _pairs(value, number)}
    return _marked_object(value, number)


def _marked_object(value: Any, number: Callable[[Any], int]) -> Any:
    if isinstance(value, (bytes, bytearray, memoryview)):
        return {"b": base64.b64encode(value).decode()}
    if isinstance(value, (np.ndarray, np.generic)):
        return marked(value.tolist(), number)
    for plain in (str, bool, int, float):
        if isinstance(value, plain):
            return plain(value)
    if callable(value):
        return {"f": number(value)}
    by_name = fields(value)
    if by_name is not None:
        return {"o": _pairs(by_name, number)}
    if isinstance(value, Iterable):
        return [marked(item, number) for item in value]
    raise TypeError(f"a {type(value).__name__} cannot be passed between a script and the simulation")


def _pairs(mapping: Mapping[Any, Any], number: Callable[[Any], int]) -> list[list[Any]]:
    return [[marked(key, number), marked(item, number)] for key, item in mapping.items()]


def written(items: list[Any]) -> bytes:
    """Return items as a message of the script's process. Raises ValueError and RecursionError."""
    return _encode(items).encode()


def read(message: bytes) -> list[Any]:
    """Return the items of a message of the script's process, each a list beginning with a string.

    Raises InvalidMessage.
    """
    try:
        text = message.decode()
        items, end = _decode(text)
    except (ValueError, RecursionError):
        raise InvalidMessage("not JSON") from None
    if type(items) is not list or end != len(text):
        raise InvalidMessage("not a list of items")
    for item in items:
        if type(item) is not list or not item or type(item[0]) is not str:
            raise InvalidMessage("not a list of items")
    return items


def unmarked(value: Any, function: Callable[[int], Any], depth: int = 0) -> Any:
    """Return the value that `marked` has encoded; `function` returns a function by its number.

    Raises InvalidMessage.
    """
    kind = type(value)
    if kind in PLAIN:
        return value
    if depth > DEEPEST:
        raise InvalidMessage("values nested too deeply")
    if kind is list:
        return value if ALL_PLAIN(map(type, value)) else [unmarked(item, function, depth + 1) for item in value]
    mark = next(iter(value), "")
    inner: Any = value.get(mark)
    content = type(inner)
    if len(value) != 1 or content is not _MARKS.get(mark):
        raise InvalidMessage("unknown mark")
    if mark == "b":
        try:
            return base64.b64decode(inner, validate=True)
        except ValueError:
            raise InvalidMessage("not base64") from None
    if mark == "f":
        return function(inner)
    if mark == "t":
        return tuple([unmarked(item, function, depth + 1) for item in inner])
    return _mapping(mark, inner, function, depth)


def _mapping(mark: str, pairs: list[Any], function: Callable[[int], Any], depth: int) -> Any:
    if not all(type(item) is list and len(item) == 2 for item in pairs):
        raise InvalidMessage("not a list of pairs")
    decoded = [(unmarked(key, function, depth + 1), unmarked(item, function, depth + 1)) for key, item in pairs]
    try:
        if mark == "d":
            return dict(decoded)
    except TypeError:
        raise InvalidMessage("not a valid key") from None
    if not all(type(key) is str and key.isidentifier() and not key.startswith("_") for key, _ in decoded):
        raise InvalidMessage("unknown field")
    return SimpleNamespace(**dict(decoded))
