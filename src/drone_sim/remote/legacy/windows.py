"""User interface commands: status bar, consoles, dialogs, and V-REP 3.x's custom user interfaces."""

from __future__ import annotations

import struct

from drone_sim.remote.legacy.asked import Asked, Served, Table, nothing
from drone_sim.remote.legacy.values import ints, text

_NO_BUTTON = -1
_SKIPPED = 0  # clients skip a number, because they expect a key of two numbers
_COLORS = 48  # bytes, of a dialog's title and text


def _open_console(ask: Asked) -> bytes:
    lines, *_ = ask.take("6i6f")
    return ints(ask.sim("auxiliaryConsoleOpen", *ask.key, lines))


def _print(ask: Asked) -> bytes:
    printed = ask.data.rstrip(b"\0").decode("utf-8", "replace") if ask.data else None
    return nothing(ask.sim("auxiliaryConsolePrint", *ask.key, printed))


def _show(ask: Asked) -> bytes:
    return nothing(ask.sim("auxiliaryConsoleShow", *ask.key, *ask.take("i")))


def _open_dialog(ask: Asked) -> bytes:
    message, end, rest = ask.data.partition(b"\0")
    if not end or len(rest) < struct.calcsize("<i") + 1 + _COLORS:
        raise ask.refused(f"{len(ask.data)} bytes of data are not a valid dialog")
    (style,) = struct.unpack_from("<i", rest)
    initial = rest[4:-_COLORS].rstrip(b"\0")
    texts = message.decode("utf-8", "replace"), initial.decode("utf-8", "replace")
    handle = ask.sim("displayDialog", *ask.key, texts[0], style, False, texts[1])
    return ints(handle, handle)


def _close_dialog(ask: Asked) -> bytes:
    if not ask.sim("endDialog", *ask.key):
        raise ask.refused(f"there is no dialog with the handle {ask.key[0]}")
    return b""


def _set_ui(name: str, function: str) -> Served:
    return Served(name, lambda ask: nothing(ask.sim(function, *ask.key)))


WINDOWS: Table = {
    0x3008: Served("simxAddStatusbarMessage", lambda ask: nothing(ask.sim("addStatusbarMessage", *ask.key))),
    0x3009: Served("simxAuxiliaryConsoleOpen", _open_console),
    0x1014: Served("simxAuxiliaryConsoleClose", lambda ask: nothing(ask.sim("auxiliaryConsoleClose", *ask.key))),
    0x1015: Served("simxAuxiliaryConsolePrint", _print),
    0x1016: Served("simxAuxiliaryConsoleShow", _show),
    0x300C: Served("simxDisplayDialog", _open_dialog),
    0x102B: Served("simxEndDialog", _close_dialog),
    0x102C: Served("simxGetDialogInput", lambda ask: text(ask.sim("getDialogInput", *ask.key))),
    0x102D: Served("simxGetDialogResult", lambda ask: ints(ask.sim("getDialogResult", *ask.key))),
    0x3007: Served("simxGetUIHandle", lambda ask: ints(ask.sim("getUIHandle", *ask.key))),
    0x2001: Served("simxGetUISlider", lambda ask: ints(ask.sim("getUISlider", *ask.key))),
    0x2002: _set_ui("simxSetUISlider", "setUISlider"),
    0x1029: _set_ui("simxRemoveUI", "removeUI"),
    0x2003: Served("simxGetUIEventButton", lambda ask: ints(_SKIPPED, _NO_BUTTON, 0, 0)),
    0x2004: Served("simxGetUIButtonProperty", lambda ask: ints(ask.sim("getUIButtonProperty", *ask.key))),
    0x2005: _set_ui("simxSetUIButtonProperty", "setUIButtonProperty"),
    0x2006: _set_ui("simxSetUIButtonLabel", "setUIButtonLabel"),
}
