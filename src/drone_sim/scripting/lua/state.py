"""A Lua state for one script: Lua itself, and what the .lua files here put into it.

The files run once in a fresh state (5.1 or newer), before the script is read. What one of them has for the others, and
for Python, it leaves in a table that is called `sandbox` there.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drone_sim.scripting import script_log
from drone_sim.scripting.api.constants import CALL_TYPES
from drone_sim.scripting.api.turns import CALLS_PER_MS, DEFAULT_MS, LONGEST_MS, NO_THREAD, SHORTEST_MS, SOON
from drone_sim.scripting.errors import LONGEST_MESSAGE
from drone_sim.scripting.lua.helpers import LuaHelpers
from drone_sim.scripting.lua.thread import Door, SameThread
from drone_sim.scripting.lua.values import MEMORY, MIB, Values
from drone_sim.scripting.phase_names import FUNCTIONS
from drone_sim.scripting.time_limit import TimeLimit

OLDEST = "lua51"  # V-REP 3.x's
_NEWEST_FIRST = ("lua55", "lua54", "lua53", "lua52", OLDEST)
_FILES = (
    "limits",
    "matrices",
    "threads",
    "others",
    "values",
    "code",
    "unknown",
    "snapshots",
    "calls",
    "globals",
    "matrix",
    "files",
)  # each uses those before it
_CAP = MEMORY + 256 * MIB  # where Lua gets no more: what lupa itself allocates in between must never fail

Reader = Callable[[bytes], tuple[bool, bytes, bytes]]  # of a name: whether there is one, text, name of the chunk
TIME, OVER_MEMORY, MUCH_MEMORY = 1, 2, -1  # why Lua stops a script, or looks at it more often (limits.lua)
_MUCH = 32 * MIB


def newest() -> str:
    """Return the newest Lua that lupa has; raises ImportError."""
    for dialect in _NEWEST_FIRST:
        if importlib.util.find_spec(f"lupa.{dialect}"):
            return dialect
    raise ImportError("lupa has no Lua")


def new_runtime(dialect: str) -> Any:
    """Return lupa's runtime of a new state, out of which nothing leads to Python. Raises ImportError."""
    return importlib.import_module(f"lupa.{dialect}").LuaRuntime(
        encoding=None,
        register_eval=False,
        register_builtins=False,
        attribute_filter=_nothing_of_python,
        unpack_returned_tuples=True,
        max_memory=_CAP,
    )


def make_sandbox(runtime: Any, door: Door, limit: TimeLimit, values: Values, helpers: LuaHelpers, threads: bool) -> Any:
    """Run the .lua files in a new state; return their `sandbox`. `threads`: the script may have some.

    What Lua gets of Python must not lead back to the script's object, or neither is ever freed.
    """
    bridge = {
        **values.bridge(),
        "look": _look(door, limit, values),
        "log": _log(door),
        "direct": isinstance(door, SameThread),
        "longest_message": 4 * LONGEST_MESSAGE,
        "longest_line": 4 * script_log.LONGEST,
        "phases": _phase_functions,
        "call_types": _call_types,
        "threads": threads,
        "no_thread": NO_THREAD.encode(),
        "soon": SOON,
        "calls_per_ms": CALLS_PER_MS,
        "default_ms": DEFAULT_MS,
        "shortest_ms": SHORTEST_MS,
        "longest_ms": LONGEST_MS,
        "module": _reader(door, helpers.read),
        "file": _reader(door, helpers.read_file),
    }
    table, sandbox = runtime.table_from({key.encode(): value for key, value in bridge.items()}), runtime.table()
    for name, text in _texts().items():
        runtime.execute(text, table, sandbox, f"={helpers.chunk}".encode(), name=f"=({name}.lua)".encode())
    return sandbox


@functools.cache
def _texts() -> dict[str, bytes]:
    return {name: Path(__file__).with_name(f"{name}.lua").read_bytes() for name in _FILES}


def _look(door: Door, limit: TimeLimit, values: Values) -> Callable[[], int]:
    """Return what Lua's hook asks: whether the script is to be stopped, or to be looked at more often, and for what."""

    def look() -> int:
        used = values.used()
        if used > MEMORY and values.too_much():
            return OVER_MEMORY
        if door.closed or limit.exceeded():
            return TIME
        return MUCH_MEMORY if used > _MUCH else 0

    return look


def _log(door: Door) -> Callable[[bytes], None]:
    def log(line: bytes) -> None:
        if not door.closed:
            script_log.say(line)

    return log


def _reader(door: Door, read: Reader) -> Reader:
    return lambda name: (False, b"stopped", b"") if door.closed else read(name)


def _phase_functions() -> tuple[bytes, ...]:
    return tuple(name.encode() for name in FUNCTIONS.values())


def _call_types() -> tuple[int, ...]:
    return tuple(CALL_TYPES.values())


def _nothing_of_python(_object: Any, name: Any, _is_setting: bool) -> Any:
    raise AttributeError(f"no access to {name!r}")
