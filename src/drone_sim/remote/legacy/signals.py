"""Signals: named values through which clients and scripts exchange data."""

from __future__ import annotations

from typing import Any

from drone_sim.remote.legacy.request import Handler, Refused, Request, Table, nothing
from drone_sim.remote.legacy.values import floats, ints, raw, string


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
    0x3013: Handler(
        "simxSetFloatSignal", lambda request: nothing(request.sim("setFloatSignal", *request.key, *request.take("f")))
    ),
    0x3014: Handler(
        "simxSetIntegerSignal",
        lambda request: nothing(request.sim("setIntegerSignal", *request.key, *request.take("i"))),
    ),
    0x3015: Handler("simxSetStringSignal", _set_string),
    0x3016: Handler("simxAppendStringSignal", _append),
    TAKE_STRING: Handler("simxGetAndClearStringSignal", _take),
    0x3018: Handler("simxReadStringStream", _read_stream),
    0x300D: _clear("simxClearFloatSignal", "clearFloatSignal"),
    0x300E: _clear("simxClearIntegerSignal", "clearIntegerSignal"),
    0x300F: _clear("simxClearStringSignal", "clearStringSignal"),
}
