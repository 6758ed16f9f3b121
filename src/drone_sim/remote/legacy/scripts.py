"""Signals, and simxCallScriptFunction: calls of scripts with four lists of arguments and results."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from drone_sim.remote.legacy.request import (
    Handler,
    Refused,
    Request,
    Table,
    direct,
    floats,
    ints,
    nothing,
    raw,
    string,
    text,
)

_COUNTS = struct.Struct("<4i")
_CHILD = 1  # sim.scripttype_childscript


def _call(request: Request) -> bytes:
    kind, name, function = request.key
    if kind & 0xF != _CHILD:
        raise request.refused(f"type of script {kind}: must be sim_scripttype_childscript ({_CHILD})")
    function_name, _, object_name = function.partition("@")  # older programs append the object's name to the function's
    script = request.sim("getScriptHandle", name or object_name)
    returned = request.sim("callScriptFunction", function_name, script, *_arguments(request))
    return _written(request, list(returned) if isinstance(returned, tuple) else [returned])


def _arguments(request: Request) -> list[Any]:
    """Return integers, floats, strings and a buffer. Raises Refused if the data does not match their counts."""
    if len(request.data) < _COUNTS.size:
        raise request.refused(f"{len(request.data)} bytes of data are too few for the arguments")
    counts = whole, real, strings, size = _COUNTS.unpack_from(request.data)
    texts_at = _COUNTS.size + 4 * (whole + real)
    *texts, buffer = request.data[texts_at:].split(b"\0", strings) if min(counts) >= 0 else [b""]
    if min(counts) < 0 or texts_at > len(request.data) or len(texts) != strings or len(buffer) != size:
        raise request.refused(f"{len(request.data)} bytes of data are not {whole}, {real}, {strings} and {size} values")
    numbers = struct.unpack_from(f"<{whole}i{real}f", request.data, _COUNTS.size)
    return [list(numbers[:whole]), list(numbers[whole:]), [string(value) for value in texts], string(buffer)]


def _written(request: Request, returned: Sequence[Any]) -> bytes:
    """Return the encoded results of a script. Raises Refused if they are not such lists."""
    whole, real, strings, buffer = [part if part is not None else "" for part in [*returned, *[None] * 4][:4]]
    try:
        texts = [text(value) for value in strings]
        values = ints(*whole) + floats(*real) + b"".join(texts) + raw(buffer)
        return ints(len(whole), len(real), len(texts), len(raw(buffer))) + values
    except (TypeError, ValueError, struct.error, OverflowError):
        expected = "whole numbers, numbers, strings, and one string, as lists"
        raise request.refused(f"{request.key[2]} returned something else than {expected}") from None


SCRIPTS: Table = {0x3401: Handler("simxCallScriptFunction", _call)}


def _value(request: Request, function: str) -> Any:
    """Return the value of a signal. Raises Refused, without a text, if it is not set."""
    value = request.sim(function, *request.key)
    if value is None:
        raise Refused("")
    return value


def _set_string(request: Request) -> bytes:
    return nothing(request.sim("setStringSignal", *request.key, string(request.data)))


def _append(request: Request) -> bytes:
    before = request.sim("getStringSignal", *request.key)
    return nothing(request.sim("setStringSignal", *request.key, string(raw(before or "") + request.data)))


def _take(request: Request) -> bytes:
    value = raw(_value(request, "getStringSignal"))
    request.sim("clearStringSignal", *request.key)
    return value


def _read_stream(request: Request) -> bytes | None:
    """Return what was written since the last call; the client appends it to its unread data."""
    return _take(request) if request.sim("getStringSignal", *request.key) else None


def _clear(function: str, clears: str) -> Handler:
    return Handler(function, lambda request: nothing(request.sim(clears, request.key[0] or None)))


TAKE_STRING = 0x3017
SIGNALS: Table = {
    0x3010: Handler("simxGetFloatSignal", lambda request: floats(_value(request, "getFloatSignal"))),
    0x3011: Handler("simxGetIntegerSignal", lambda request: ints(_value(request, "getIntegerSignal"))),
    0x3012: Handler("simxGetStringSignal", lambda request: raw(_value(request, "getStringSignal"))),
    0x3013: direct("setFloatSignal", nothing, "f"),
    0x3014: direct("setIntegerSignal", nothing, "i"),
    0x3015: Handler("simxSetStringSignal", _set_string),
    0x3016: Handler("simxAppendStringSignal", _append),
    TAKE_STRING: Handler("simxGetAndClearStringSignal", _take),
    0x3018: Handler("simxReadStringStream", _read_stream),
    0x300D: _clear("simxClearFloatSignal", "clearFloatSignal"),
    0x300E: _clear("simxClearIntegerSignal", "clearIntegerSignal"),
    0x300F: _clear("simxClearStringSignal", "clearStringSignal"),
}
