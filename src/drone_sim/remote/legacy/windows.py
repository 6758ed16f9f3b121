"""User interface commands: status bar, consoles, dialogs, and V-REP 3.x's custom user interfaces."""

from __future__ import annotations

import struct

from drone_sim.remote.legacy.request import Handler, Request, Table, direct, ints, nothing, text

_NO_BUTTON = -1
_SKIPPED = 0  # clients skip a number, because they expect a key of two numbers
_COLORS = 48  # bytes, of a dialog's title and text


def _open_console(request: Request) -> bytes:
    lines, *_ = request.take("6i6f")
    return ints(request.sim("auxiliaryConsoleOpen", *request.key, lines))


def _print(request: Request) -> bytes:
    printed = request.data.rstrip(b"\0").decode("utf-8", "replace") if request.data else None
    return nothing(request.sim("auxiliaryConsolePrint", *request.key, printed))


def _open_dialog(request: Request) -> bytes:
    message, end, rest = request.data.partition(b"\0")
    if not end or len(rest) < struct.calcsize("<i") + 1 + _COLORS:
        raise request.refused(f"{len(request.data)} bytes of data are not a valid dialog")
    (style,) = struct.unpack_from("<i", rest)
    initial = rest[4:-_COLORS].rstrip(b"\0")
    texts = message.decode("utf-8", "replace"), initial.decode("utf-8", "replace")
    handle = request.sim("displayDialog", *request.key, texts[0], style, False, texts[1])
    return ints(handle, handle)


def _close_dialog(request: Request) -> bytes:
    if not request.sim("endDialog", *request.key):
        raise request.refused(f"there is no dialog with the handle {request.key[0]}")
    return b""


WINDOWS: Table = {
    0x3008: direct("addStatusbarMessage", nothing),
    0x3009: Handler("simxAuxiliaryConsoleOpen", _open_console),
    0x1014: direct("auxiliaryConsoleClose", nothing),
    0x1015: Handler("simxAuxiliaryConsolePrint", _print),
    0x1016: direct("auxiliaryConsoleShow", nothing, "i"),
    0x300C: Handler("simxDisplayDialog", _open_dialog),
    0x102B: Handler("simxEndDialog", _close_dialog),
    0x102C: direct("getDialogInput", text),
    0x102D: direct("getDialogResult", ints),
    0x3007: direct("getUIHandle", ints),
    0x2001: direct("getUISlider", ints),
    0x2002: direct("setUISlider", nothing),
    0x1029: direct("removeUI", nothing),
    0x2003: Handler("simxGetUIEventButton", lambda request: ints(_SKIPPED, _NO_BUTTON, 0, 0)),
    0x2004: direct("getUIButtonProperty", ints),
    0x2005: direct("setUIButtonProperty", nothing),
    0x2006: direct("setUIButtonLabel", nothing),
}
