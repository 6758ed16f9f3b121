"""simxCallScriptFunction: calls of child scripts' functions, with four lists of arguments and results."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from drone_sim.remote.legacy.request import Handler, Request, Table
from drone_sim.remote.legacy.values import floats, ints, raw, string, text

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
