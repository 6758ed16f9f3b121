"""Connections to the remote API's port: browsers, peers with any version of ZMTP (rfc.zeromq.org), noise.

A case is a list of connections, each a list of pieces that are sent in order. Only a peer that begins with the whole
greeting of ZMTP 3 may call a function; such peers make harmless calls here, the others try to start the simulation.
"""

import cbor2
from case import Case
from hypothesis import strategies as st

from kinds.values import mutated

_START = cbor2.dumps({"func": "sim.startSimulation", "args": []})
_HARMLESS = cbor2.dumps({"func": "sim.getSimulationTime", "args": []})
_SIGNATURE = b"\xff" + bytes(8) + b"\x7f"


def _frame(content: bytes, flags: int = 0) -> bytes:
    """Return a frame of ZMTP 2 and 3."""
    if len(content) < 256:
        return bytes([flags, len(content)]) + content
    return bytes([flags | 2]) + len(content).to_bytes(8, "big") + content


def _old(content: bytes, flags: int = 0) -> bytes:
    """Return a frame of ZMTP 1."""
    return bytes([1 + len(content), flags]) + content


def _ready(kind: bytes) -> bytes:
    return _frame(b"\5READY\x0bSocket-Type" + len(kind).to_bytes(4, "big") + kind + b"\x08Identity\0\0\0\0", 4)


_UNVERSIONED = _old(b"") + _old(b"", 1) + _old(_START)
_VERSIONED = [_SIGNATURE + b"\1\5" + _frame(b""), _frame(b"", 1) + _frame(_START)]
_FRAMES = st.lists(
    st.one_of(
        st.just(_frame(b"", 1) + _frame(_HARMLESS)),
        st.just(_frame(b"\4PING\0\1x", 4)),
        st.just(_frame(b"", 1) * 200),
        st.sampled_from([b"\2" + b"\xff" * 8, b"\2" + (9 << 20).to_bytes(8, "big"), b"\6" + b"\x7f" * 8]),
        st.builds(_frame, st.binary(max_size=300), st.integers(0, 255)),
        st.binary(max_size=40),
    ),
    max_size=4,
)
_ZMTP_3 = st.tuples(
    st.builds(
        lambda version, mechanism: _SIGNATURE + version + mechanism.ljust(20, b"\0") + bytes(32),
        st.sampled_from([b"\3\0", b"\3\1", b"\4\0", b"\xff\xff"]),
        st.sampled_from([b"NULL", b"PLAIN", b"CURVE", b"GSSAPI", b""]),
    ).flatmap(mutated),
    st.sampled_from([b"REQ", b"DEALER", b"ROUTER", b"PUB", b"x" * 300]).map(_ready).flatmap(mutated),
    _FRAMES.map(b"".join),
).map(list)
_HEADERS = st.lists(
    st.sampled_from(
        [
            b"User-Agent: Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 Chrome/126.0.0.0 Safari/537.36",
            b"User-Agent: curl/7.88.1",
            b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13",
            b"Origin: http://example.org",
            b"Expect: 100-continue",
            b"Transfer-Encoding: chunked",
            b"X: " + b"a" * 300,
        ]
    ),
    max_size=4,
)
_BODY = st.sampled_from([b"", _START, _UNVERSIONED, b"".join(_VERSIONED), _SIGNATURE + b"\3\1NULL" + bytes(48)])
_HTTP = st.builds(
    lambda line, headers, body: b"\r\n".join([line, b"Host: 127.0.0.1:23000", *headers, b"", body]),
    st.sampled_from([b"GET / HTTP/1.1", b"POST /sim HTTP/1.1", b"OPTIONS * HTTP/1.0", b"PRI * HTTP/2.0", b"GET /"]),
    _HEADERS,
    _BODY,
)
_CONNECTION = st.one_of(
    st.lists(_HTTP, min_size=1, max_size=3),
    st.sampled_from([[_UNVERSIONED], [_UNVERSIONED[:3], _UNVERSIONED[3:]], _VERSIONED, [b"\1\0\2\0x"]]),
    st.binary(max_size=60).map(lambda noise: [noise]),
    _ZMTP_3,
    st.just([]),
)
CASES = st.builds(Case, st.just("connections"), st.just({}), st.lists(_CONNECTION, min_size=1, max_size=6))
