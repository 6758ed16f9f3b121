"""Values on their way through the door.

Messages to the script are written by `marshal`: the script can trust the simulation. Messages from the script are JSON,
which can contain nothing but what is read here; a JSON object is a mark, named by its only key:

    {"t": [...]}  a tuple          {"d": [[key, value], ...]}  a mapping      {"b": "..."}  bytes, in base64
    {"f": 3}      a function       {"o": [[name, value], ...]}  an object with fields, such as a message
"""

from __future__ import annotations

import base64
import binascii
import json
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from drone_sim.scripting.api.script_values import DEEPEST
from drone_sim.scripting.api.scripts import FunctionsOfScript, handle_of
from drone_sim.scripting.door.functions import ScriptFunction
from drone_sim.scripting.lua.values import fields

_PLAIN = frozenset((float, int, bool, str, type(None)))
_ALL_PLAIN = _PLAIN.issuperset
_MARKS = {"b": str, "f": int, "t": list, "d": list, "o": list}
_KEPT = frozenset((*_PLAIN, bytes))
_ALL_KEPT = _KEPT.issuperset
_encode = json.JSONEncoder(check_circular=False, separators=(",", ":")).encode
_decode = json.JSONDecoder().raw_decode


class NoMessage(ValueError):
    """The script's process has sent something that is not a valid message."""


# ---- to the script


def outgoing(value: Any) -> Any:
    """Return a value of the API as marshal writes it: plain ones as they are, others as (mark, ...)."""
    kind = type(value)
    if kind in _KEPT:
        return value
    if kind is list:
        return value if _ALL_KEPT(map(type, value)) else [outgoing(one) for one in value]
    if kind is tuple:
        return ("tuple", *map(outgoing, value))
    if isinstance(value, Mapping):
        return ("mapping", [(outgoing(key), outgoing(one)) for key, one in value.items()])
    return _outgoing_object(value)


def _outgoing_object(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return outgoing(value.tolist())
    for kind, made in _OUTGOING:
        if isinstance(value, kind):
            return made(value)
    if hasattr(value, "to_sec"):
        return float(value.to_sec())
    named = fields(value)
    if named is None:
        return [outgoing(one) for one in value]
    is_tuple = isinstance(value, tuple)
    return "object", type(value).__name__, is_tuple, [(str(name), outgoing(one)) for name, one in named.items()]


_OUTGOING: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
    ((bytearray, memoryview), bytes),
    (FunctionsOfScript, lambda value: ("functions", handle_of(value))),
    (ScriptFunction, lambda value: ("function", value.number)),
    *((kind, kind) for kind in (str, bool, int, float)),  # of a class of its own
)


def incoming(value: Any, function: Callable[[int], Any], functions: Callable[[int], Any]) -> Any:
    """Return, in the script's process, what `outgoing` was given.

    `function` gives one of the script's own by its number, `functions` those of the script with a handle.
    """
    kind = type(value)
    if kind is list:
        return value if _ALL_KEPT(map(type, value)) else [incoming(one, function, functions) for one in value]
    if kind is not tuple:
        return value
    mark, *rest = value
    if mark == "tuple":
        return tuple([incoming(one, function, functions) for one in rest])
    if mark == "mapping":
        return {incoming(key, function, functions): incoming(one, function, functions) for key, one in rest[0]}
    if mark == "object":
        name, is_tuple, named = rest
        found = {key: incoming(one, function, functions) for key, one in named}
        return _class_of(name, tuple(found))(**found) if is_tuple else SimpleNamespace(**found)
    return (functions if mark == "functions" else function)(rest[0])


_classes: dict[tuple[str, tuple[str, ...]], Any] = {}


def _class_of(name: str, names: tuple[str, ...]) -> Any:
    if (name, names) not in _classes:
        _classes[name, names] = namedtuple(name, names)
    return _classes[name, names]


# ---- from the script


def marked(value: Any, number: Callable[[Any], int]) -> Any:
    """Return, in the script's process, a value as JSON can have it. Raises TypeError for what cannot be handed over.

    `number` gives the number of a function.
    """
    kind = type(value)
    if kind in _PLAIN:
        return value
    if kind is list:
        return value if _ALL_PLAIN(map(type, value)) else [marked(one, number) for one in value]
    if kind is tuple:
        return {"t": [marked(one, number) for one in value]}
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
    named = fields(value)
    if named is not None:
        return {"o": _pairs(named, number)}
    if isinstance(value, Iterable):
        return [marked(one, number) for one in value]
    raise TypeError(f"a {type(value).__name__} cannot be passed between a script and the simulation")


def _pairs(named: Mapping[Any, Any], number: Callable[[Any], int]) -> list[list[Any]]:
    return [[marked(key, number), marked(one, number)] for key, one in named.items()]


def written(items: list[Any]) -> bytes:
    """Return a message of the script's process as bytes. Raises ValueError and RecursionError."""
    return _encode(items).encode()


def read(message: bytes) -> list[Any]:
    """Return the items of a message of the script's process, each a list that begins with a text. Raises NoMessage."""
    try:
        text = message.decode()
        items, end = _decode(text)
    except (ValueError, RecursionError):
        raise NoMessage("not JSON") from None
    if type(items) is not list or end != len(text):
        raise NoMessage("no list of items")
    for one in items:
        if type(one) is not list or not one or type(one[0]) is not str:
            raise NoMessage("no list of items")
    return items


def unmarked(value: Any, function: Callable[[int], Any], depth: int = 0) -> Any:
    """Return what `marked` was given; `function` stands for the script's own with a number. Raises NoMessage."""
    kind = type(value)
    if kind in _PLAIN:
        return value
    if depth > DEEPEST:
        raise NoMessage("values nested too deeply")
    if kind is list:
        return value if _ALL_PLAIN(map(type, value)) else [unmarked(one, function, depth + 1) for one in value]
    mark, inner = _mark(value)
    if mark == "b":
        return _bytes(inner)
    if mark == "f":
        return function(inner)
    if mark == "t":
        return tuple([unmarked(one, function, depth + 1) for one in inner])
    return _mapping(mark, inner, function, depth)


def _mark(value: dict[str, Any]) -> tuple[str, Any]:
    """Return a mark, and what it is of. Raises NoMessage."""
    if len(value) == 1:
        ((mark, inner),) = value.items()
        if type(inner) is _MARKS.get(mark):
            return mark, inner
    raise NoMessage("unknown mark")


def _mapping(mark: str, pairs: list[Any], function: Callable[[int], Any], depth: int) -> Any:
    if not all(type(one) is list and len(one) == 2 for one in pairs):
        raise NoMessage("not a list of pairs")
    found = [(unmarked(key, function, depth + 1), unmarked(one, function, depth + 1)) for key, one in pairs]
    try:
        if mark == "d":
            return dict(found)
    except TypeError:
        raise NoMessage("not a valid key") from None
    if not all(type(key) is str and key.isidentifier() and not key.startswith("_") for key, _ in found):
        raise NoMessage("unknown field")
    return SimpleNamespace(**dict(found))


def _bytes(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise NoMessage("not base64") from None
