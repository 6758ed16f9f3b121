"""simxCallScriptFunction: calls of child scripts' functions, with four lists of arguments and results."""

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
    function_name, _, object_name = function.partition("@")  # older programs append the object's name to the function's
    script = ask.sim("getScriptHandle", name or object_name)
    returned = ask.sim("callScriptFunction", function_name, script, *_arguments(ask))
    return _written(ask, list(returned) if isinstance(returned, tuple) else [returned])


def _arguments(ask: Asked) -> list[Any]:
    """Return integers, floats, strings and a buffer. Raises Refused if the data does not match their counts."""
    if len(ask.data) < _COUNTS.size:
        raise ask.refused(f"{len(ask.data)} bytes of data are too few for the arguments")
    counts = whole, real, strings, size = _COUNTS.unpack_from(ask.data)
    texts_at = _COUNTS.size + 4 * (whole + real)
    *texts, buffer = ask.data[texts_at:].split(b"\0", strings) if min(counts) >= 0 else [b""]
    if min(counts) < 0 or texts_at > len(ask.data) or len(texts) != strings or len(buffer) != size:
        raise ask.refused(f"{len(ask.data)} bytes of data are not {whole}, {real}, {strings} and {size} values")
    numbers = struct.unpack_from(f"<{whole}i{real}f", ask.data, _COUNTS.size)
    return [list(numbers[:whole]), list(numbers[whole:]), [string(value) for value in texts], string(buffer)]


def _written(ask: Asked, returned: Sequence[Any]) -> bytes:
    """Return the encoded results of a script. Raises Refused if they are not such lists."""
    whole, real, strings, buffer = [part if part is not None else "" for part in [*returned, *[None] * 4][:4]]
    try:
        texts = [text(value) for value in strings]
        values = ints(*whole) + floats(*real) + b"".join(texts) + raw(buffer)
        return ints(len(whole), len(real), len(texts), len(raw(buffer))) + values
    except (TypeError, ValueError, struct.error, OverflowError):
        expected = "whole numbers, numbers, strings, and one string, as lists"
        raise ask.refused(f"{ask.key[2]} returned something else than {expected}") from None


SCRIPTS: Table = {0x3401: Served("simxCallScriptFunction", _call)}
