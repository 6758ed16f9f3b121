"""simxCallScriptFunction: functions of child scripts, with four lists of values in and out."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from drone_sim.remote.legacy.asked import Asked, Served, Table
from drone_sim.remote.legacy.values import floats, ints, raw, string, text

_COUNTS = struct.Struct("<4i")
_CHILD = 1  # sim.scripttype_childscript


def _call(ask: Asked) -> bytes:
    kind, name, function = ask.key
    if kind & 0xF != _CHILD:
        raise ask.refused(f"type of script {kind}: must be sim_scripttype_childscript ({_CHILD})")
    called, _, below = function.partition("@")  # older programs name the object behind the function
    script = ask.sim("getScriptHandle", name or below)
    returned = ask.sim("callScriptFunction", called, script, *_given(ask))
    return _written(ask, list(returned) if isinstance(returned, tuple) else [returned])


def _given(ask: Asked) -> list[Any]:
    """Return whole numbers, numbers, texts and a buffer. Raises Refused where there are not so many."""
    if len(ask.data) < _COUNTS.size:
        raise ask.refused(f"{len(ask.data)} bytes of data are too few for the arguments")
    counts = whole, real, strings, size = _COUNTS.unpack_from(ask.data)
    texts_at = _COUNTS.size + 4 * (whole + real)
    *texts, buffer = ask.data[texts_at:].split(b"\0", strings) if min(counts) >= 0 else [b""]
    if min(counts) < 0 or texts_at > len(ask.data) or len(texts) != strings or len(buffer) != size:
        raise ask.refused(f"{len(ask.data)} bytes of data are not {whole}, {real}, {strings} and {size} values")
    numbers = struct.unpack_from(f"<{whole}i{real}f", ask.data, _COUNTS.size)
    return [list(numbers[:whole]), list(numbers[whole:]), [string(one) for one in texts], string(buffer)]


def _written(ask: Asked, returned: Sequence[Any]) -> bytes:
    """Return what a script returned. Raises Refused where that is not such lists."""
    whole, real, strings, buffer = [one if one is not None else "" for one in [*returned, *[None] * 4][:4]]
    try:
        texts = [text(one) for one in strings]
        values = ints(*whole) + floats(*real) + b"".join(texts) + raw(buffer)
        return ints(len(whole), len(real), len(texts), len(raw(buffer))) + values
    except (TypeError, ValueError, struct.error, OverflowError):
        expected = "whole numbers, numbers, strings, and one string, as lists"
        raise ask.refused(f"{ask.key[2]} returned something else than {expected}") from None


SCRIPTS: Table = {0x3401: Served("simxCallScriptFunction", _call)}
