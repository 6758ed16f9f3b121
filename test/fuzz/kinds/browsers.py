"""Input of the cockpit's port: (HTTP requests, messages of our page), all as bytes."""

import json

from case import Case
from hypothesis import strategies as st

from kinds.values import junk, mostly, mutated, texts

# ---- HTTP

_PATHS = st.one_of(
    st.sampled_from(["/", "/mesh/", "/socket", "/cockpit.js", "/?token=", "/?token=TOKEN", "//[", "/?token=%ff", "*"]),
    st.sampled_from(["/mesh/%2e%2e/x", "/mesh/\x00", "/../../etc/passwd", "http://[/", "/?" + "&" * 4000]),
    texts,
)
_NAMES_OF_HEADERS = (
    *("Host", "Cookie", "Origin", "Upgrade", "Connection", "Accept-Encoding", "Content-Length", "Transfer-Encoding"),
    *("Sec-WebSocket-Key", "Sec-WebSocket-Version", "Sec-WebSocket-Protocol", "Sec-WebSocket-Extensions"),
)
_HEADERS = st.tuples(
    st.sampled_from(_NAMES_OF_HEADERS),
    st.one_of(
        st.sampled_from(["localhost", "[::1", "websocket", "Upgrade", "13", "drone_sim", "viewer-1", "null", "-1"]),
        st.sampled_from(["drone_sim_PORT=TOKEN", "drone_sim_=TOKEN", "=;;[", "http://127.0.0.1:PORT", "chunked", "é"]),
        texts,
    ),
)


def _request(parts):
    path, headers, has_cookie = parts
    known = [("Host", "127.0.0.1:PORT"), ("Cookie", "drone_sim_PORT=TOKEN")] if has_cookie else []
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in [*known, *headers])]
    return "\r\n".join((*lines, "", "")).encode("utf-8", "surrogatepass")


_WRITTEN = st.tuples(_PATHS, st.lists(_HEADERS, max_size=6), st.booleans()).map(_request)
_REQUEST = st.one_of(_WRITTEN, _WRITTEN, _WRITTEN.flatmap(mutated), st.binary(max_size=60))

# ---- our page

_REQUESTS = (
    *("scripts", "open", "look", "save", "save_as", "keep", "revert", "lesson", "run", "graded"),
    *("windows", "answer", "camera", "panel", "call", "request", "speed", "scene", "vehicle", "tune", "plots"),
)
_SCRIPTS = st.sampled_from(
    [
        "built-in/pilot.py",
        "tutorial/1_thrust.py",
        "tasks/hover.py",
        "mine/a.py",
        "mine/link.py",
        "mine/fifo.py",
        "mine/d.py",
    ]
)
_NAMES = st.sampled_from(["a.py", "link.py", "fifo.py", "d.py", "b.lua", "../x.py", "\ud800.py", "x" * 300 + ".py"])
_FIELDS = st.fixed_dictionaries(
    {"ask": mostly(st.sampled_from(_REQUESTS))},
    optional={
        "id": mostly(st.integers(0, 99)),
        "script": mostly(_SCRIPTS),
        "name": mostly(_NAMES),
        "text": mostly(st.one_of(texts, st.just("\ud800"), st.just("x" * 1_100_000))),
        "version": mostly(st.just("")),
        "mine": st.booleans(),
        "lesson": mostly(st.sampled_from(["stage-2-elevation", "tasks/hover", "tasks/wind", ""])),
        "number": junk,
        "handle": junk,
        "button": junk,
        "typed": junk,
        "topic": mostly(st.just("/drone/front")),
        "call": mostly(st.sampled_from(["start", "pause", "resume", "step"])),
        "request": mostly(st.sampled_from(["takeoff", "home"])),
        "factor": junk,
        "scene": mostly(st.sampled_from(["none", "gates", "mine/a.yaml", "/etc/passwd"])),
        "vehicle": mostly(st.just("wing")),
        "value": junk,
        "charts": mostly(st.dictionaries(st.sampled_from(["height", "velocity", "x"]), junk, max_size=3)),
        "on": junk,
        "hold": mostly(st.dictionaries(st.sampled_from(["vx", "vy", "vz", "wz", "ax"]), junk, max_size=3)),
        "shown": junk,
        "drag": mostly(st.sampled_from(["start", "move", "end"])),
        "server": mostly(st.sampled_from(["markers", "objects"])),
        "pose": mostly(st.lists(st.floats(-10, 10), min_size=7, max_size=7)),
        "push": mostly(st.just("drone")),
        "ray": mostly(st.lists(st.floats(-1, 1), min_size=3, max_size=3)),
        "newtons": junk,
    },
)


def _encode(fields):
    try:
        return json.dumps(fields, default=str).encode()
    except (ValueError, TypeError):  # a key that JSON does not allow
        return b"{"


_DEEP = st.sampled_from(
    [b"[" * 900, b'{"ask":' * 900, b'{"id":1,"ask":"open","script":' + b"[" * 300 + b"]" * 300 + b"}"]
)
_MESSAGE = st.one_of(
    _FIELDS.map(_encode), _FIELDS.map(_encode), _FIELDS.map(_encode).flatmap(mutated), junk.map(_encode), _DEEP
)

CASES = st.builds(
    Case, st.just("browsers"), st.just({}), st.tuples(st.lists(_REQUEST, max_size=3), st.lists(_MESSAGE, max_size=5))
)
