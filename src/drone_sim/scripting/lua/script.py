"""Child scripts in Lua, each in a Lua state of its own, from which nothing else can be accessed.

V-REP 3.x scripts run in Lua 5.1, with flat names (simGetObjectPosition, simExtRosInterface_subscribe,
sim_handle_self). If the text uses `sim_call_type`, it is run once for each phase, with `sim_call_type` set; source.py
has the other forms. CoppeliaSim 4.x scripts run in the newest Lua that lupa contains, with `sim`, `simROS` and
functions sysCall_init, ... Both forms of the API exist in all versions.
"""

from __future__ import annotations

import difflib
import logging
import re
import weakref
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from drone_sim.message_text import near_names
from drone_sim.scripting import phase_names, script_log
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.api.constants import CALL_TYPES, CONSTANTS, CUSTOMIZATION_PHASES
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError, no_function
from drone_sim.scripting.lua import functions, state
from drone_sim.scripting.lua.helpers import LuaHelpers
from drone_sim.scripting.lua.source import LuaSource, mixed_forms
from drone_sim.scripting.lua.thread import MOST_ABANDONED, Abandoned, Executor, LuaThread, SameThread, count_abandoned
from drone_sim.scripting.time_limit import Labels, TimeLimit

_LOG = logging.getLogger(__name__)  # for messages about scripts, not from scripts
_NIL = re.compile(r"(?:field|global|method) '(\w+)'")
_NUMBERS = {phase: number for number, phase in enumerate(CALL_TYPES, start=1)}
_NEAR = 0.8  # least ratio of difflib
_THREAD = 1 << _NUMBERS["thread"] - 1
# Functions in calls.lua.
_CALLS = (
    *("open", "phase", "called", "called_own", "executed", "executed_own", "called_back", "has", "functions"),
    *("save_state", "restore", "variables", "break_at"),
)
_EXECUTE = "executeScriptString"
_MOST_PLACES = 4000  # values, two for each breakpoint, that one call passes
_ABOUT_MEMORY = f"not enough memory: the script uses more than {state.MEMORY // state.MIB} MiB"


class LuaScript(Script):
    """A Lua file that may define sysCall_init, ..., or uses sim_call_type."""

    language = "lua"

    def __init__(
        self,
        path: str,
        source: bytes,
        modules: Mapping[str, Api],
        limit: TimeLimit,
        breakpoints: Breakpoints | None = None,
        customizes: bool = False,
    ):
        """Compile `source`, the contents of the file `path`; run its top level, unless each phase runs the whole file.

        `modules` are the API, `limit` is its time limit. `breakpoints` belong to all scripts.
        `customizes`: whether it is a customization script. Raises ScriptError.
        """
        self._path = path
        self._limit, self._labels = limit, Labels(path, limit)
        text = LuaSource(source)
        self.is_empty = not text.text.strip()
        self.flat_names: Collection[str] = text.flat_names
        self._modules = modules
        self._end = ""  # why it cannot be called any more; '' while it can
        self._phases = 0
        self._helpers = LuaHelpers(path)
        self._breakpoints = breakpoints if breakpoints is not None else Breakpoints()
        self._check_form(text)
        if text.loops_in_c and count_abandoned() >= MOST_ABANDONED:
            raise self._error(
                "load",
                f"{MOST_ABANDONED} Lua scripts hang in this process, and no more can be loaded: restart the simulator",
            )
        self._thread: Executor = LuaThread(limit) if text.loops_in_c else SameThread(limit)
        try:
            dialect = state.dialect_for(text.text, bool(text.flat_names) or "phases" in text.form)
            self._has_coroutines = text.coroutines
            self._lua = self._thread.run(self._build, dialect, text.threads)
            if self._breakpoints:
                self.follow_breakpoints()
            self._run("load", self._lua["open"], text.text, text.form.encode())
            if text.form == "functions":
                self._check_names(customizes)
        except BaseException:
            self._thread.close()
            raise

    def _build(self, dialect: str, threads: bool) -> dict[str, Any]:
        """Create a Lua state with the API; return its functions for Python. `threads`: the script may have some."""
        self._state = state.LuaState(dialect, self._thread, self._limit, self._helpers, threads, self._breakpoints)
        self._finalizer = weakref.finalize(self, _free, self._state)
        self._known = self._state.known = functions.define(self._state, self._modules)
        _LOG.debug("%s runs in %s", self._path, dialect)
        return {name: self._state.sandbox[name.encode()] for name in _CALLS}

    # ---- the script

    def _check_form(self, text: LuaSource) -> None:
        """Raise ScriptError for a script with two forms, or an unknown sim_childscriptcall_... (nil in Lua)."""
        if text.mixed:
            raise self._error("load", mixed_forms(*text.mixed), max(text.mixed))
        known = [name for name in CONSTANTS if name.startswith("childscriptcall_")]
        for name in text.call_types:
            if name not in known:
                line = text.line(name)
                raise self._error("load", f"there is no sim_{name}; {near_names(name, known)}", line)

    def _check_names(self, customizes: bool) -> None:
        """Raise ScriptError for a misspelt phase function."""
        places = self._named_functions()
        for name, intended in phase_names.misspelt(places):
            raise ScriptError("load", *places[name], phase_names.never_called(name, intended))
        phase_names.warn(self._path, places, customizes)
        self.idle = phase_names.idle(places, customizes)

    def _named_functions(self) -> dict[str, tuple[str, int]]:
        """Return file and line of the script's global functions, by name."""
        words = self._run("load", self._lua.get("functions")).decode("utf-8", "replace").split("\n")
        return {
            name: (self._helpers.path(chunk), int(line))
            for name, line, chunk in zip(words[::3], words[1::3], words[2::3])
        }

    def _check_callback(self, callback: Callback) -> None:
        name = callback.encode() if isinstance(callback, str) else callback
        if not self._run(str(callback), self._lua.get("has"), name):
            raise self._error(str(callback), no_function(callback, self._named_functions()))

    def _run_phase(self, phase: str) -> None:
        number = _NUMBERS[phase]
        if self._phases & 1 << number - 1 or phase in CUSTOMIZATION_PHASES:
            if self._end and phase == "cleanup":  # the error was raised before
                return
            self._run(phase, self._lua.get("phase"), number)

    def _has_thread(self) -> bool:
        return bool(self._phases & _THREAD) and not self._end

    def _resume_thread(self) -> None:
        self._run("thread", self._lua.get("phase"), _NUMBERS["thread"])

    def _has_function(self, name: str) -> bool:
        path, _ = self._named_functions().get(name, ("", 0))
        return path == self._path

    def _run_function(self, name: str, arguments: list[Any]) -> Any:
        to_lua = self._state.values.to_lua
        self._run(name, lambda: self._lua["called"](name.encode(), *to_lua(arguments, unpacked=True)))
        return self._state.values.returned()

    def call_own(self, name: Callback, arguments: list[Any]) -> Any:
        arguments = self._state.values.to_lua(arguments, unpacked=True)
        key = name.encode() if isinstance(name, str) else name
        self._check_own(str(name), self._lua["called_own"](key, *arguments))
        return self._state.values.returned()

    def _run_text(self, text: str) -> Any:
        self._run(_EXECUTE, self._lua.get("executed"), text.encode("utf-8", "replace"))
        return self._state.values.returned()

    def execute_own(self, text: str) -> Any:
        self._check_own(_EXECUTE, self._lua["executed_own"](text.encode("utf-8", "replace")))
        return self._state.values.returned()

    def _check_own(self, name: str, outcome: Any) -> None:
        status, *details = outcome if isinstance(outcome, tuple) else (outcome,)
        if status is not True:
            raise self._failure(name, status, details)

    def _run_callback(self, callback: Callback, message: Any) -> None:
        self._call_back(callback, message, False)

    def _answer_request(self, callback: Callback, request: Any) -> Any:
        self._call_back(callback, request, True)
        return self._state.values.returned()

    def _call_back(self, callback: Callback, message: Any, returns: bool) -> None:
        name, key = (callback, callback.encode()) if isinstance(callback, str) else ("callback", callback)
        to_lua = self._state.values.to_lua
        self._run(name, lambda: self._lua["called_back"](key, to_lua(message), returns))

    def follow_breakpoints(self) -> None:
        places: list[bytes | int] = []
        for path, lines in self._breakpoints.all().items():
            chunk = self._helpers.chunk_of(path).encode("utf-8", "replace")
            if chunk:
                places += [part for line in sorted(lines) for part in (chunk, line)]
        if not self._end:
            self._run("breakpoints", self._lua["break_at"], *places[:_MOST_PLACES])

    def variables(self) -> list[Scope]:
        return [] if self._end else state.read_rows(self._run("variables", self._lua["variables"]))

    def _save(self) -> Callable[[], None]:
        snapshot = self._run("snapshot", self._lua.get("save_state"))

        def restore() -> None:
            if self._has_thread() or self._has_coroutines:
                script_log.say(script_log.THREAD_GOES_ON.format(self._path))
            self._run("restore", self._lua.get("restore"), snapshot)

        return restore

    def close(self) -> None:
        """Free the Lua state; the script cannot be called afterwards."""
        self._finalizer()
        self._end = self._end or "the script was closed"
        self._phases = 0
        self._lua.clear()

    def _run(self, phase: str, function: Any, *arguments: Any) -> Any:
        """Call a function in Lua's thread; return its result. Raises ScriptError."""
        if self._end:
            raise self._error(phase, self._end)
        self._limit.label = self._labels[phase]
        try:
            outcome = self._thread.run(function, *arguments)
        except Abandoned:
            self._end = str(self._limit)
            raise self._error(phase, self._end) from None
        except Exception as error:  # of lupa, or a value that cannot be passed
            message = str(error) or type(error).__name__
            if message == "stopped":  # by a hook before the beginning or after the end of the script
                message = _ABOUT_MEMORY if self._state.used() > state.MEMORY else str(self._limit)
            raise self._error(phase, message) from None
        finally:
            script_log.end_call()
            if not self._end and self._state.used() > state.MEMORY and self._state.too_much():
                self._end = _ABOUT_MEMORY  # in another call, lupa itself might run out of memory
        self._phases, status, *details = outcome if isinstance(outcome, tuple) else (outcome, True, None)
        if status is True:
            if not self._end:
                return details[0]
            status, details = state.OVER_MEMORY, []
        raise self._failure(phase, status, details)

    def _failure(self, phase: str, status: Any, details: Sequence[Any]) -> ScriptError:
        """Return the error for a status from Lua; `details` are a message, or line and file where it was stopped."""
        if status is False:
            text = details[0].decode("utf-8", "replace").partition("\nstack traceback:")[0]
            if text == "not enough memory":
                return self._error(phase, _ABOUT_MEMORY)
            path, line, text = self._helpers.parse_message(text)
            return ScriptError(phase, path, line, text + self._hint(text))
        if status == state.TIME:
            return self._error(phase, str(self._limit), *details)
        if status == state.OVER_MEMORY:
            self._end = _ABOUT_MEMORY
            return self._error(phase, self._end, *details)
        return self._error(phase, no_function(phase, ()))

    def _error(self, phase: str, message: str, line: int = 0, chunk: bytes = b"") -> ScriptError:
        return ScriptError(phase, self._helpers.path(chunk.decode("utf-8", "replace")), int(line), message)

    def _hint(self, text: str) -> str:
        """Return a hint for an error about nil: similar names, or the reason why a plugin is missing."""
        match = _NIL.search(text) if "nil value" in text else None
        if match is None:
            return ""
        name = match.group(1)
        if name in PLUGINS:
            return f"; {not_there('', name, ())}"
        near = difflib.get_close_matches(name, self._known, cutoff=_NEAR)  # often none: most names are the script's own
        return f"; near names are {', '.join(near)}" if near else ""


def _free(lua: state.LuaState) -> None:
    lua.executor.close()
    lua.close()
