"""Clients of V-REP's legacy remote API: a list of connections, each a list of pieces that are sent in order.

Most pieces are messages with commands that the server knows; some are mutated, some are noise.
"""

import struct

from case import Case
from hypothesis import strategies as st

from drone_sim.remote.legacy.commands import FUNCTIONS
from kinds.scripts import OBJECTS
from kinds.values import ODD_TEXTS, mutated

_HEADER, _COMMAND, _PACKET = struct.Struct("<HBiiiHB"), struct.Struct("<iiHiiHiBB"), struct.Struct("<hhh")
_OWN = [*range(0, 12), 0x1013, 0x3401, 0x3FFF]
_INTEGERS = st.one_of(st.integers(-2, 30), st.sampled_from([-(2**31), 2**31 - 1, -11, -12, 109, 0x400000]))
_TEXTS = st.sampled_from([*OBJECTS, *(one for one in ODD_TEXTS if len(one) < 1000)])
_FLOATS = st.floats(width=32)


def _number(value):
    return struct.pack("<i", value)


def _text(value):
    return value.encode("utf-8", "replace") + b"\0"


def _key(code):
    """Return a strategy of keys for the command."""
    if code >= 0x3400:
        return st.tuples(_INTEGERS.map(_number), _TEXTS.map(_text), _TEXTS.map(_text)).map(b"".join)
    if code >= 0x3000:
        return _TEXTS.map(_text)
    count = 2 if code >= 0x2000 else 1 if code >= 0x1000 else 0
    return st.lists(_INTEGERS.map(_number), min_size=count, max_size=count).map(b"".join)


_DATA = st.one_of(
    st.just(b""),
    _INTEGERS.map(_number),
    _FLOATS.map(lambda value: struct.pack("<f", value)),
    st.tuples(_INTEGERS, _FLOATS, _FLOATS, _FLOATS).map(lambda values: struct.pack("<i3f", *values)),
    st.lists(_INTEGERS, min_size=4, max_size=6).map(lambda values: struct.pack(f"<{len(values)}i", *values)),
    _TEXTS.map(_text),
    st.binary(max_size=60),
)


@st.composite
def _command(draw):
    code = draw(st.one_of(st.sampled_from(sorted(FUNCTIONS)), st.sampled_from(_OWN), st.integers(0, 0xFFFF)))
    key, data = draw(_mostly(_key(code)))[:60_000], draw(_DATA)
    mode = draw(st.sampled_from([0, 1, 1, 1, 2, 2, 3, 4, 5, 6, 7, 0x7FFF]))
    shift = draw(st.sampled_from([0, 0, 0, 0, 3, -1, 2**31 - 1]))
    size = _COMMAND.size + len(key) + len(data)
    whole = size + (draw(st.sampled_from([0, 4, -4])) if shift else 0)
    fields = (size, whole, len(key), shift, code | mode << 16, draw(st.sampled_from([0, 0, 50, 65535])), 0, 0, 0)
    return _COMMAND.pack(*fields) + key + data


def _mostly(strategy):
    """Return a strategy's values, some of them mutated."""
    return st.one_of(strategy, strategy, strategy, strategy.flatmap(mutated))


def _packets(content, piece):
    pieces = [content[start : start + piece] for start in range(0, len(content), piece)]
    left = len(pieces)
    return b"".join(_PACKET.pack(1, len(one), left - count) + one for count, one in enumerate(pieces, 1))


_MESSAGE = st.builds(
    lambda number, commands: _HEADER.pack(0, 11, number, 0, 0, 0, 0) + b"".join(commands),
    st.integers(0, 9),
    st.lists(_command(), max_size=6),
)
_SENT = st.one_of(
    *[st.builds(_packets, _mostly(_MESSAGE), st.sampled_from([40, 1294, 32767]))] * 4,
    st.builds(_packets, _MESSAGE, st.just(1294)).flatmap(mutated),
    st.builds(_PACKET.pack, *[st.one_of(st.sampled_from([0, 1, 18]), st.integers(-(2**15), 2**15 - 1))] * 3),
    st.binary(max_size=60),
    st.just(b"GET / HTTP/1.1\r\nHost: 127.0.0.1:19997\r\n\r\n"),
)
CASES = st.builds(
    Case, st.just("legacy_commands"), st.just({}), st.lists(st.lists(_SENT, max_size=6), min_size=1, max_size=4)
)
