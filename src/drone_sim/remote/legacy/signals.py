"""Signals: named values through which clients and scripts exchange data."""

from __future__ import annotations

from typing import Any

from drone_sim.remote.legacy.asked import Asked, Refused, Served, Table, nothing
from drone_sim.remote.legacy.values import floats, ints, raw, string


def _value(ask: Asked, function: str) -> Any:
    """Return the value of a signal. Raises Refused, without a text, if it is not set."""
    value = ask.sim(function, *ask.key)
    if value is None:
        raise Refused("")
    return value


def _set_string(ask: Asked) -> bytes:
    return nothing(ask.sim("setStringSignal", *ask.key, string(ask.data)))


def _append(ask: Asked) -> bytes:
    before = ask.sim("getStringSignal", *ask.key)
    return nothing(ask.sim("setStringSignal", *ask.key, string(raw(before or "") + ask.data)))


def _take(ask: Asked) -> bytes:
    value = raw(_value(ask, "getStringSignal"))
    ask.sim("clearStringSignal", *ask.key)
    return value


def _read_stream(ask: Asked) -> bytes | None:
    """Return what was written since the last call; the client appends it to its unread data."""
    return _take(ask) if ask.sim("getStringSignal", *ask.key) else None


def _clear(function: str, clears: str) -> Served:
    return Served(function, lambda ask: nothing(ask.sim(clears, ask.key[0] or None)))


TAKE_STRING = 0x3017
SIGNALS: Table = {
    0x3010: Served("simxGetFloatSignal", lambda ask: floats(_value(ask, "getFloatSignal"))),
    0x3011: Served("simxGetIntegerSignal", lambda ask: ints(_value(ask, "getIntegerSignal"))),
    0x3012: Served("simxGetStringSignal", lambda ask: raw(_value(ask, "getStringSignal"))),
    0x3013: Served("simxSetFloatSignal", lambda ask: nothing(ask.sim("setFloatSignal", *ask.key, *ask.take("f")))),
    0x3014: Served("simxSetIntegerSignal", lambda ask: nothing(ask.sim("setIntegerSignal", *ask.key, *ask.take("i")))),
    0x3015: Served("simxSetStringSignal", _set_string),
    0x3016: Served("simxAppendStringSignal", _append),
    TAKE_STRING: Served("simxGetAndClearStringSignal", _take),
    0x3018: Served("simxReadStringStream", _read_stream),
    0x300D: _clear("simxClearFloatSignal", "clearFloatSignal"),
    0x300E: _clear("simxClearIntegerSignal", "clearIntegerSignal"),
    0x300F: _clear("simxClearStringSignal", "clearStringSignal"),
}
