"""Requests and replies as CBOR (RFC 8949), with the fields of versions 1 and 2 of CoppeliaSim's protocol.

A request has `func` and `args`, and since version 2 `uuid`, which identifies the client. The reply has `ret`, the list
of the function's results, or `err`; version 1 reads `success`, `ret` and `error`. A reply with `func` and `args` asks
the client to call one of its own functions first, and to send the result as the `args` of EXECUTED.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import cbor2
import numpy as np

from drone_sim.message_text import shown
from drone_sim.scripting.api.types import DEEPEST, refuse_if_too_large

EXECUTED = "_*executed*_"
END = "_*end*_"  # ends the session
_NIL = "_*NIL*_"
_MAX_NAME = 200  # characters of a name
_DEFAULT_PATIENCE = 600.0  # s, for clients that do not specify it
_ARRAY_TYPES = {  # RFC 8746: typed arrays of numbers, by tag
    64: ">u1", 65: ">u2", 66: ">u4", 67: ">u8", 68: ">u1", 69: "<u2", 70: "<u4", 71: "<u8",
    72: ">i1", 73: ">i2", 74: ">i4", 75: ">i8", 77: "<i2", 78: "<i4", 79: "<i8",
    80: ">f2", 81: ">f4", 82: ">f8", 84: "<f2", 85: "<f4", 86: "<f8",
}  # fmt: skip


class ClientRequest(NamedTuple):
    """A client's request: the name of a function, such as sim.getObject, and its arguments.

    client: its uuid, '' in version 1; patience: s without a message after which it is removed.
    """

    function: str
    arguments: list[Any]
    client: str = ""
    patience: float = _DEFAULT_PATIENCE


def read(payload: bytes) -> ClientRequest:
    """Return the request in a message. Raises ValueError, in one line, for an invalid message."""
    try:
        content = cbor2.loads(payload, tag_hook=_untagged, max_depth=DEEPEST + 2)
    except Exception as error:  # invalid numbers, dates and patterns raise various errors
        raise ValueError(f"not a request: {' '.join(str(error).split())[:_MAX_NAME]}") from None
    if not isinstance(content, dict):
        raise ValueError(f"not a request: must be a map with `func` and `args`, not {shown(content)}")
    return ClientRequest(
        _text(content, "func"),
        _arguments(content.get("args")),
        _text(content, "uuid", ""),
        _seconds(content.get("timeout")),
    )


def success(values: Sequence[Any]) -> bytes:
    """Return the reply with a function's results. Raises ValueError for unsupported values."""
    return _written({"success": True, "ret": values})


def failure(line: str) -> bytes:
    """Return the reply that the client raises as an exception."""
    text = line.encode("utf-8", "replace").decode()
    return _written({"success": False, "error": text, "err": text})


def call(function: str, arguments: Sequence[Any]) -> bytes:
    """Return the reply that requests a call of a client's function. Raises ValueError for unsupported values."""
    return _written({"func": function, "args": arguments})


def _text(content: Mapping[Any, Any], key: str, default: str | None = None) -> str:
    value = content.get(key, default)
    if not isinstance(value, str) or len(value) > _MAX_NAME:
        raise ValueError(f"not a request: `{key}` = {shown(value)}: must be a string of at most {_MAX_NAME} characters")
    return value


def _arguments(values: Any) -> list[Any]:
    if not values and not isinstance(values, (str, bytes, int, float)):  # Lua may encode an empty list as a map or nil
        return []
    if not isinstance(values, list):
        raise ValueError(f"not a request: `args` = {shown(values)}: must be a list")
    refuse_if_too_large(values, _fields)
    return [None if value == _NIL else value for value in values]


def _fields(value: Any) -> Mapping[Any, Any] | None:
    """Return a map unchanged, None for a list. Raises ValueError for types that scripts do not have, such as a date."""
    if isinstance(value, dict):
        return value
    if type(value) is list:
        return None
    raise ValueError(f"a {type(value).__name__} cannot be passed to a script")


def _seconds(value: Any) -> float:
    is_valid = isinstance(value, (int, float)) and math.isfinite(value) and value > 0
    return min(float(value), _DEFAULT_PATIENCE) if is_valid else _DEFAULT_PATIENCE


def _untagged(tag: cbor2.CBORTag, _immutable: bool) -> Any:
    kind = _ARRAY_TYPES.get(tag.tag)
    if kind is None:
        raise ValueError(f"unknown CBOR tag {tag.tag}")
    return np.frombuffer(tag.value, kind).tolist()


def _written(reply: Mapping[str, Any]) -> bytes:
    try:
        return cbor2.dumps(reply, default=_encode)
    except (cbor2.CBOREncodeError, RecursionError) as error:
        raise ValueError(f"the returned value cannot be sent: {' '.join(str(error).split())[:_MAX_NAME]}") from None


def _encode(encoder: cbor2.CBOREncoder, value: Any) -> None:
    """Encode types that CBOR lacks: arrays, ROS messages and ROS times."""
    if isinstance(value, (np.ndarray, np.generic)):
        encoder.encode(value.tolist())
    elif hasattr(value, "to_sec"):
        encoder.encode(value.to_sec())
    elif hasattr(value, "__slots__"):
        encoder.encode({name: getattr(value, name) for name in value.__slots__ if not name.startswith("_")})
    else:
        raise cbor2.CBOREncodeTypeError(f"a {type(value).__name__}")
