"""Lua state of one script, prepared by the .lua files in this folder, with a memory limit.

The files run once in a new state (5.1 or newer), before the script is compiled. They store what the other files and
Python need in a table, their parameter `sandbox`.
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
from drone_sim.scripting.api.control import CALLS_PER_MS, DEFAULT_MS, LONGEST_MS, NO_THREAD, SHORTEST_MS
from drone_sim.scripting.breakpoints import LONGEST_NAME, LONGEST_VALUE, MOST_INSIDE, MOST_ROWS, Breakpoints, Row, Scope
from drone_sim.scripting.errors import LONGEST_MESSAGE
from drone_sim.scripting.lua.helpers import LuaHelpers
from drone_sim.scripting.lua.thread import Executor, SameThread
from drone_sim.scripting.lua.values import Values
from drone_sim.scripting.phase_names import FUNCTIONS
from drone_sim.scripting.time_limit import TimeLimit

OLDEST = "lua51"  # the version in V-REP 3.x
_NEWEST_FIRST = ("lua55", "lua54", "lua53", "lua52", OLDEST)
_FILES = ("limits", "threads", "values", "code", "calls", "globals", "matrix", "files", "variables")  # in this order
MIB = 1024 * 1024
MEMORY = 256 * MIB  # bytes that a script may use
_CAP = MEMORY + 256 * MIB  # at which allocations fail; larger, because lupa's own allocations must not fail
_MUCH = 32 * MIB

_END_OF_FIELD, _END_OF_ROW = "\x1f", "\x1e"
Reader = Callable[[bytes], tuple[bool, bytes, bytes]]  # by name: whether it exists, text, chunk name
TIME, OVER_MEMORY, MUCH_MEMORY = 1, 2, -1  # why Lua stops a script, or checks it more often (limits.lua)


@functools.cache
def _newest_first() -> list[str]:
    """Return the Lua versions that lupa contains. Raises ImportError if there is none."""
    dialects = [dialect for dialect in _NEWEST_FIRST if importlib.util.find_spec(f"lupa.{dialect}")]
    if not dialects:
        raise ImportError("lupa has no Lua")
    return dialects


def dialect_for(text: bytes, flat: bool) -> str:
    """Return the Lua version for a script: 5.1 if it uses `flat` names, otherwise the newest that can compile it.

    An older one is needed, for example, if a script sets the variable of a `for` loop, which Lua 5.5 forbids. A script
    that no version can compile gets the first choice. Raises ImportError.
    """
    candidates = [OLDEST, *_newest_first()] if flat else _newest_first()
    return next((dialect for dialect in candidates if _parses(dialect, text)), candidates[0])


def _parses(dialect: str, text: bytes) -> bool:
    lupa = importlib.import_module(f"lupa.{dialect}")
    try:
        lupa.LuaRuntime(encoding=None, register_eval=False, register_builtins=False, max_memory=_CAP).compile(text)
    except lupa.LuaSyntaxError:
        return False
    except lupa.LuaError:  # out of memory, which is reported when the script is loaded
        return True
    return True


def syntax_error(text: bytes, flat: bool) -> str:
    """Return the error message of the compiler for a text, '' if it can be compiled; the text is not run.

    `flat`: it uses V-REP 3.x names. Raises ImportError.
    """
    lupa = importlib.import_module(f"lupa.{dialect_for(text, flat)}")
    try:
        lua = lupa.LuaRuntime(encoding=None, register_eval=False, register_builtins=False, max_memory=_CAP)
        lua.compile(text, name=b"=script")
    except lupa.LuaError as error:
        message = error.args[0]
        return message.decode("utf-8", "replace") if isinstance(message, bytes) else str(message)
    return ""


class LuaState:
    """Lua state of one script. It must be closed, because Python cannot free a reference cycle that includes Lua.

    Python objects that are passed to Lua must not refer to the LuaScript, or both are never freed.
    """

    def __init__(
        self,
        dialect: str,
        executor: Executor,
        limit: TimeLimit,
        helpers: LuaHelpers,
        threads: bool,
        breakpoints: Breakpoints,
    ):
        """Create a state from which no Python object can be accessed. Raises ImportError.

        `executor` runs all calls into it, `limit` is the script's time limit, `helpers` reads the required files.
        `threads`: whether it may have threads. `breakpoints` belong to all scripts.
        """
        self.executor = executor
        self.runtime: Any = importlib.import_module(f"lupa.{dialect}").LuaRuntime(
            encoding=None,
            register_eval=False,
            register_builtins=False,
            attribute_filter=_nothing_of_python,
            unpack_returned_tuples=True,
            max_memory=_CAP,
        )
        # Bytes; Lua's own count excludes 5.5's long strings.
        self.used: Callable[[], int] = self.runtime.get_memory_used
        self.waits = 0  # unfinished waits of API functions in coroutines
        self.known: set[str] = set()  # names in the API
        self.warned: set[str] = set()  # functions that were called with too many values
        self.values = Values(self.runtime.table_from)
        bridge = {
            **self.values.bridge(),
            "look": functools.partial(self._check, limit),
            "log": self._log,
            "direct": isinstance(executor, SameThread),
            "longest_message": 4 * LONGEST_MESSAGE,
            "longest_line": 4 * script_log.LONGEST,
            "phases": lambda: tuple(name.encode() for name in FUNCTIONS.values()),
            "call_types": lambda: tuple(CALL_TYPES.values()),
            "threads": threads,
            "no_thread": NO_THREAD.encode(),
            "calls_per_ms": CALLS_PER_MS,
            "default_ms": DEFAULT_MS,
            "shortest_ms": SHORTEST_MS,
            "longest_ms": LONGEST_MS,
            "module": self._reader(helpers.read),
            "file": self._reader(helpers.read_file),
            "data": self._reader(helpers.read_data),
            "most_rows": MOST_ROWS,
            "most_inside": MOST_INSIDE,
            "longest_value": LONGEST_VALUE,
            "reached": functools.partial(_reach, breakpoints, helpers),
            "is_first": lambda: breakpoints.reached is None,
            "known": self._known_names,
        }
        table = self.runtime.table_from({key.encode(): value for key, value in bridge.items()})
        self.sandbox: Any = self.runtime.table()
        for name, text in _texts().items():
            chunk, file = f"={helpers.chunk}".encode(), f"=({name}.lua)".encode()
            self.runtime.execute(text, table, self.sandbox, chunk, name=file)

    def close(self) -> None:
        self.runtime = self.sandbox = None
        self.values.close()
        self.used = int

    def too_much(self) -> bool:
        """Return whether the script uses too much memory, if necessary after a garbage collection."""
        if self.used() <= MEMORY:
            return False
        self.runtime.gccollect()
        return self.used() > MEMORY

    def _check(self, limit: TimeLimit) -> int:
        """Return, for Lua's hook, why to stop the script (TIME, OVER_MEMORY) or check it more often; 0 to continue."""
        used = self.used()
        if used > MEMORY and self.too_much():
            return OVER_MEMORY
        if self.executor.closed or limit.exceeded():
            return TIME
        return MUCH_MEMORY if used > _MUCH else 0

    def _log(self, line: bytes) -> None:
        if not self.executor.closed:
            script_log.say(line)

    def _known_names(self) -> Any:
        return self.runtime.table_from({name.encode(): True for name in self.known})

    def _reader(self, read: Reader) -> Reader:
        return lambda name: (False, b"stopped", b"") if self.executor.closed else read(name)


# ---- variables and breakpoints, as variables.lua reports them


def read_rows(text: bytes) -> list[Scope]:
    """Return the scopes encoded in a text, with their rows sorted by name, because Lua's order is random."""
    scopes: list[Scope] = []
    inside: list[Row] = []
    for row in reversed(text.decode("utf-8", "replace").split(_END_OF_ROW)):
        depth, name, kind, value = (*row.split(_END_OF_FIELD), "", "", "", "")[:4]
        if depth == "2":
            inside.append(Row(name[:LONGEST_NAME], kind, value))
        elif depth == "1":
            scopes = scopes or [Scope("", [])]
            scopes[-1].rows.append(Row(name[:LONGEST_NAME], kind, value, tuple(sorted(inside, key=_sort_key))))
            inside = []
        elif depth == "0":
            scopes = [*(scopes or [Scope("", [])])]
            scopes[-1] = Scope(name, sorted(scopes[-1].rows))
            scopes.append(Scope("", []))
    return scopes[:-1][::-1]


def _sort_key(row: Row) -> tuple[bool, float, str]:
    """Return a sort key: first the indices of lists, by number, then names."""
    number = row.name[1:-1] if row.name[:1] == "[" else ""
    is_number = number.lstrip("-").isdigit()
    return not is_number, float(number) if is_number else 0.0, row.name


def _reach(breakpoints: Breakpoints, helpers: LuaHelpers, chunk: bytes, line: int, rows: bytes) -> None:
    breakpoints.reach(helpers.path(chunk.decode("utf-8", "replace")), int(line), lambda: read_rows(rows))


@functools.cache
def _texts() -> dict[str, bytes]:
    return {name: Path(__file__).with_name(f"{name}.lua").read_bytes() for name in _FILES}


def _nothing_of_python(_object: Any, name: Any, _is_setting: bool) -> Any:
    raise AttributeError(f"access is not allowed to {name!r}")
