"""Requests and replies as bytes: CBOR (RFC 8949), with the fields of versions 1 and 2 of CoppeliaSim's protocol.

A request has `func` and `args`, and from version 2 on `uuid`, which says who asks. The reply to it has `ret`, a list of
what the function returned, or `err`; version 1 reads `success`, `ret` and `error`. A reply with `func` and `args` asks
the client to call a function of its own first, and to send what that returned as the `args` of EXECUTED.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import cbor2
import numpy as np

from drone_sim.message_text import shown
from drone_sim.scripting.api.script_values import DEEPEST, refuse_if_too_large

EXECUTED = "_*executed*_"
END = "_*end*_"  # says goodbye
_NOTHING = "_*NIL*_"
_LONGEST = 200  # characters of a name
_PATIENCE = 600.0  # s, of clients that do not say theirs
_NUMBERS = {  # RFC 8746: arrays of numbers in one string of bytes, by tag
    64: ">u1", 65: ">u2", 66: ">u4", 67: ">u8", 68: ">u1", 69: "<u2", 70: "<u4", 71: "<u8",
    72: ">i1", 73: ">i2", 74: ">i4", 75: ">i8", 77: "<i2", 78: "<i4", 79: "<i8",
    80: ">f2", 81: ">f4", 82: ">f8", 84: "<f2", 85: "<f4", 86: "<f8",
}  # fmt: skip


class ClientRequest(NamedTuple):
    """What a client wants: a function such as sim.getObject, by name, and what to call it with.

    client: its uuid, '' in version 1; patience: s without a word from it after which it counts as gone.
    """

    function: str
    arguments: list[Any]
    client: str = ""
    patience: float = _PATIENCE


def read(payload: bytes) -> ClientRequest:
    """Return the request in a message. Raises ValueError, in one line, for what is none."""
    try:
        content = cbor2.loads(payload, tag_hook=_untagged, max_depth=DEEPEST + 2)
    except Exception as error:  # whatever the bytes made of a number, a date or a pattern
        raise ValueError(f"not a request: {' '.join(str(error).split())[:_LONGEST]}") from None
    if not isinstance(content, dict):
        raise ValueError(f"not a request: must be a map with `func` and `args`, not {shown(content)}")
    return ClientRequest(
        _text(content, "func"),
        _arguments(content.get("args")),
        _text(content, "uuid", ""),
        _seconds(content.get("timeout")),
    )


def success(values: Sequence[Any]) -> bytes:
    """Return the reply with what a function returned. Raises ValueError for what cannot be sent."""
    return _written({"success": True, "ret": values})


def failure(line: str) -> bytes:
    """Return the reply that a client raises as an exception."""
    text = line.encode("utf-8", "replace").decode()
    return _written({"success": False, "error": text, "err": text})


def call(function: str, arguments: Sequence[Any]) -> bytes:
    """Return the reply that asks for a call of the client's own. Raises ValueError for what cannot be sent."""
    return _written({"func": function, "args": arguments})


def _text(content: Mapping[Any, Any], key: str, default: str | None = None) -> str:
    value = content.get(key, default)
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise ValueError(f"not a request: `{key}` = {shown(value)}: must be a string of at most {_LONGEST} characters")
    return value


def _arguments(given: Any) -> list[Any]:
    if not given and not isinstance(given, (str, bytes, int, float)):  # Lua writes an empty list as it likes
        return []
    if not isinstance(given, list):
        raise ValueError(f"not a request: `args` = {shown(given)}: must be a list")
    refuse_if_too_large(given, _fields)
    return [None if one == _NOTHING else one for one in given]


def _fields(value: Any) -> Mapping[Any, Any] | None:
    """Return a map as it is, None for a list. Raises ValueError for what no script knows, such as a date."""
    if isinstance(value, dict):
        return value
    if type(value) is list:
        return None
    raise ValueError(f"a {type(value).__name__} cannot be passed to a script")


def _seconds(given: Any) -> float:
    known = isinstance(given, (int, float)) and math.isfinite(given) and given > 0
    return min(float(given), _PATIENCE) if known else _PATIENCE


def _untagged(tag: cbor2.CBORTag, _immutable: bool) -> Any:
    kind = _NUMBERS.get(tag.tag)
    if kind is None:
        raise ValueError(f"unknown CBOR tag {tag.tag}")
    return np.frombuffer(tag.value, kind).tolist()


def _written(reply: Mapping[str, Any]) -> bytes:
    try:
        return cbor2.dumps(reply, default=_encode)
    except (cbor2.CBOREncodeError, RecursionError) as error:
        raise ValueError(f"the returned value cannot be sent: {' '.join(str(error).split())[:_LONGEST]}") from None


def _encode(encoder: cbor2.CBOREncoder, value: Any) -> None:
    """Write what CBOR has no kind for: arrays, and messages and times of ROS."""
    if isinstance(value, (np.ndarray, np.generic)):
        encoder.encode(value.tolist())
    elif hasattr(value, "to_sec"):
        encoder.encode(value.to_sec())
    elif hasattr(value, "__slots__"):
        encoder.encode({name: getattr(value, name) for name in value.__slots__ if not name.startswith("_")})
    else:
        raise cbor2.CBOREncodeTypeError(f"a {type(value).__name__}")
