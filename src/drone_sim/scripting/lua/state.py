"""A Lua state for one script: Lua itself, what the .lua files here put into it, and how much memory it uses.

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
from drone_sim.scripting.api.control import CALLS_PER_MS, DEFAULT_MS, LONGEST_MS, NO_THREAD, SHORTEST_MS
from drone_sim.scripting.breakpoints import Breakpoints
from drone_sim.scripting.errors import LONGEST_MESSAGE
from drone_sim.scripting.lua import variables
from drone_sim.scripting.lua.helpers import LuaHelpers
from drone_sim.scripting.lua.thread import Executor, SameThread
from drone_sim.scripting.lua.values import Values
from drone_sim.scripting.phase_names import FUNCTIONS
from drone_sim.scripting.time_limit import TimeLimit

OLDEST = "lua51"  # V-REP 3.x's
_NEWEST_FIRST = ("lua55", "lua54", "lua53", "lua52", OLDEST)
_FILES = (
    "limits",
    "shortcuts",
    "threads",
    "values",
    "code",
    "snapshots",
    "calls",
    "globals",
    "matrix",
    "files",
    "variables",
)  # each uses those before it
MIB = 1024 * 1024
MEMORY = 256 * MIB  # bytes that a script may use
_CAP = MEMORY + 256 * MIB  # where Lua gets no more: what lupa itself allocates in between must never fail
_MUCH = 32 * MIB

Reader = Callable[[bytes], tuple[bool, bytes, bytes]]  # of a name: whether there is one, text, name of the chunk
TIME, OVER_MEMORY, MUCH_MEMORY = 1, 2, -1  # why Lua stops a script, or looks at it more often (limits.lua)


@functools.cache
def _newest_first() -> list[str]:
    """Return every Lua that lupa has; raises ImportError."""
    found = [dialect for dialect in _NEWEST_FIRST if importlib.util.find_spec(f"lupa.{dialect}")]
    if not found:
        raise ImportError("lupa has no Lua")
    return found


def newest() -> str:
    """Return the newest Lua that lupa has; raises ImportError."""
    return _newest_first()[0]


def dialect_for(text: bytes, flat: bool) -> str:
    """Return the Lua version for a script: V-REP 3.x's for `flat` names, otherwise the newest that can compile it.

    An older one is needed, for example, if a script sets the variable of a `for` loop, which Lua 5.5 forbids. A script
    that no version can compile gets the first choice. Raises ImportError.
    """
    likely = [OLDEST, *_newest_first()] if flat else _newest_first()
    return next((one for one in likely if _parses(one, text)), likely[0])


def _parses(dialect: str, text: bytes) -> bool:
    lupa = importlib.import_module(f"lupa.{dialect}")
    try:
        lupa.LuaRuntime(encoding=None, register_eval=False, register_builtins=False, max_memory=_CAP).compile(text)
    except lupa.LuaSyntaxError:
        return False
    except lupa.LuaError:  # out of memory: whoever runs it will say so
        return True
    return True


def syntax_error(text: bytes, flat: bool) -> str:
    """Return what Lua says of a text that it cannot compile, '' for any other: nothing of it is run.

    `flat`: it has names of V-REP 3.x. Raises ImportError.
    """
    lupa = importlib.import_module(f"lupa.{dialect_for(text, flat)}")
    try:
        lua = lupa.LuaRuntime(encoding=None, register_eval=False, register_builtins=False, max_memory=_CAP)
        lua.compile(text, name=b"=script")
    except lupa.LuaError as error:
        said = error.args[0]
        return said.decode("utf-8", "replace") if isinstance(said, bytes) else str(said)
    return ""


class LuaState:
    """Lua for one script. `close` frees it: Python cannot find a reference cycle that leads through Lua.

    Python objects that Lua gets must not refer to the script's object, or neither is ever freed.
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
        """Make a state, out of which nothing leads to Python. Raises ImportError.

        `executor` runs what enters it, `limit` is how long the script may run, `helpers` reads the files that it
        requires; `threads`: the script may have some; `breakpoints` are those of all scripts.
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
        self.used: Callable[[], int] = self.runtime.get_memory_used  # Lua's own count leaves out 5.5's long strings
        self.waits = 0  # of functions, in coroutines
        self.known: set[str] = set()  # names of the API
        self.lavish: set[str] = set()  # functions that have been given more values than they take
        self.values = Values(self.runtime.table_from)
        bridge = {
            **self.values.bridge(),
            "look": functools.partial(self._look, limit),
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
            **variables.bridge(breakpoints, helpers.path, self._known_names),
        }
        table = self.runtime.table_from({key.encode(): value for key, value in bridge.items()})
        self.sandbox: Any = self.runtime.table()
        for name, text in _texts().items():
            chunk, file = f"={helpers.chunk}".encode(), f"=({name}.lua)".encode()
            self.runtime.execute(text, table, self.sandbox, chunk, name=file)

    def close(self) -> None:
        """Let go of Lua."""
        self.runtime = self.sandbox = None
        self.values.close()
        self.used = int

    def too_much(self) -> bool:
        """Tell whether the script uses more memory than it may, without what it does not need any more."""
        if self.used() <= MEMORY:
            return False
        self.runtime.gccollect()
        return self.used() > MEMORY

    def _look(self, limit: TimeLimit) -> int:
        """Answer Lua's hook: whether the script is to be stopped, or to be looked at more often, and for what."""
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


@functools.cache
def _texts() -> dict[str, bytes]:
    return {name: Path(__file__).with_name(f"{name}.lua").read_bytes() for name in _FILES}


def _nothing_of_python(_object: Any, name: Any, _is_setting: bool) -> Any:
    raise AttributeError(f"access is not allowed to {name!r}")
