"""Load a Lua child script and call its phases, in a state of its own that reaches nothing else.

V-REP 3.x scripts run in Lua 5.1, with flat names (simGetObjectPosition, simExtRosInterface_subscribe,
sim_handle_self); the file's text is run once for each phase with `sim_call_type` set, where it asks for
that. CoppeliaSim 4.x scripts run in the newest Lua that lupa has, with `sim` and `simROS` and functions
sysCall_init, ... Both forms of the API are there in either.
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import re
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drone_sim.scripting import phase_names, script_log
from drone_sim.scripting.api.calls import Api, Function, contents, explain
from drone_sim.scripting.api.constants import CONSTANTS, PHASES
from drone_sim.scripting.api.messages import Callback
from drone_sim.scripting.errors import LONGEST_MESSAGE, ScriptError, no_function
from drone_sim.scripting.lua.lua_modules import LuaModules
from drone_sim.scripting.lua.lua_sandbox import PRELUDE
from drone_sim.scripting.lua.lua_source import LuaSource
from drone_sim.scripting.lua.lua_thread import MOST_LEFT, LeftBehind, LuaThread, SameThread, left_behind
from drone_sim.scripting.lua.lua_values import AS_STREAM, FAILED, TOO_MUCH, Values
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.wording import near_names

Door = LuaThread | SameThread

_LOG = logging.getLogger(__name__)
_MIB = 1024 * 1024
_MEMORY = 256 * _MIB  # bytes that a script may use
_CAP = _MEMORY + 256 * _MIB  # where Lua gets no more: what lupa itself allocates in between must never fail
_NEWEST_FIRST = ("lua55", "lua54", "lua53", "lua52", "lua51")
_FLAT = {"simROS": "simExtRosInterface_"}

_NIL = re.compile(r"(?:field|global|method) '(\w+)'")
_NUMBERS = {phase: number for number, phase in enumerate(PHASES, start=1)}
_EVERY_STEP = ("actuation", "sensing")
_TIME, _OVER_MEMORY, _MISSING = 1, 2, 3  # why Lua stopped a script, or called nothing (lua_sandbox.py)
_AS_STREAM, _TOO_MUCH, _STOPPED = (AS_STREAM,), (TOO_MUCH,), (FAILED, b"stopped")
_ABOUT_MEMORY = f"not enough memory: the script uses more than {_MEMORY // _MIB} MiB"


class LuaScript:
    """A file that defines sysCall_init, ... as it needs them, or looks at sim_call_type."""

    def __init__(self, path: str, source: bytes, modules: Mapping[str, Api], limit: TimeLimit):
        """Compile the file's text; run its top level unless it is to run in every phase. Raises ScriptError."""
        self._path = path
        self._limit = limit
        self._end = ""  # why nothing can be called any more
        self._phases = 0
        self._helpers = LuaModules(path)
        text = LuaSource(source)
        self._check_call_types(text)
        if text.loops_in_c and left_behind() >= MOST_LEFT:
            raise self._error("load", f"{MOST_LEFT} Lua scripts hang in this process: restart the simulator")
        self._thread: Door = LuaThread(limit) if text.loops_in_c else SameThread(limit)
        try:
            dialect = "lua51" if text.per_phase or text.flat else _newest()
            sandbox = self._thread.run(self._build, dialect, modules)
            self._phase, self._called_back = sandbox[b"phase"], sandbox[b"called_back"]
            self._remember, self._recall = sandbox[b"remember"], sandbox[b"recall"]
            self._has, self._functions = sandbox[b"has"], sandbox[b"functions"]
            self._run("load", sandbox[b"open"], text.text, text.per_phase)
            if not text.per_phase:
                self._check_names()
        except BaseException:
            self._thread.close()
            raise

    def _build(self, dialect: str, modules: Mapping[str, Api]) -> Any:
        """Return the sandbox (lua_sandbox.py) of a new Lua state, with the API in it."""
        lupa = importlib.import_module(f"lupa.{dialect}")
        runtime = lupa.LuaRuntime(
            encoding=None,
            register_eval=False,
            register_builtins=False,
            attribute_filter=_nothing_of_python,
            unpack_returned_tuples=True,
            max_memory=_CAP,
        )
        self._values = values = Values(runtime, _MEMORY)
        # What Lua holds of Python must not lead back to this object, or neither is ever freed.
        self._finalizer = weakref.finalize(self, _free, self._thread, values)
        bridge = {
            **values.bridge(),
            "look": _look(self._thread, self._limit, values),
            "log": _log(self._thread),
            "direct": isinstance(self._thread, SameThread),
            "longest_message": 4 * LONGEST_MESSAGE,
            "longest_line": 4 * script_log.LONGEST,
            "phases": _phase_functions,
            "module": _reader(self._thread, self._helpers),
        }
        table = runtime.table_from({key.encode(): value for key, value in bridge.items()})
        sandbox = runtime.execute(PRELUDE.encode(), table, f"={self._helpers.chunk}".encode())
        self._define(sandbox, modules)
        _LOG.debug("%s runs in %s", self._path, dialect)
        return sandbox

    # ---- the script

    def _check_call_types(self, text: LuaSource) -> None:
        """Raise ScriptError for a phase that does not exist: Lua would compare sim_call_type with nil."""
        known = [name for name in CONSTANTS if name.startswith("childscriptcall_")]
        for name in text.call_types:
            if name not in known:
                line = text.line(name)
                raise self._error("load", f"there is no sim_{name}; {near_names(name, known)}", line)

    def _check_names(self) -> None:
        """Raise ScriptError for a function that was meant to be a phase, but would not be called as one."""
        places = self._named_functions()
        for name, meant in phase_names.misspelt(places):
            raise ScriptError("load", *places[name], phase_names.never_called(name, meant))
        phase_names.warn(self._path, places)

    def _named_functions(self) -> dict[str, tuple[str, int]]:
        """Return file and line of the script's global functions, by name."""
        words = self._run("load", self._functions).decode("utf-8", "replace").split("\n")
        return {
            name: (self._helpers.path(chunk), int(line))
            for name, line, chunk in zip(words[::3], words[1::3], words[2::3])
        }

    def check(self, callback: Callback) -> None:
        """Raise ScriptError where there is no function to call back."""
        name = callback.encode() if isinstance(callback, str) else callback
        if not self._run(str(callback), self._has, name):
            raise self._error(str(callback), no_function(callback, self._named_functions()))

    def call(self, phase: str) -> None:
        """Run a phase; raises ScriptError."""
        number = _NUMBERS[phase]
        if self._phases & 1 << number - 1:
            if self._end and phase == "cleanup":  # said when it happened
                return
            self._run(phase, self._phase, number, near=phase in _EVERY_STEP)

    def callback(self, callback: Callback, message: Any) -> None:
        """Call the script's function of that name with a message; raises ScriptError."""
        name = callback if isinstance(callback, str) else "callback"
        called = callback.encode() if isinstance(callback, str) else callback
        self._run(name, self._call_back, called, message, near=True)

    def _call_back(self, callback: Any, message: Any) -> Any:
        return self._called_back(callback, self._values.to_lua(message))

    def remember(self) -> Callable[[], None]:
        """Return a function that gives the script's variables the values that they have now. Raises ScriptError."""
        snapshot = self._run("snapshot", self._remember)
        return lambda: self._run("restore", self._recall, snapshot)

    def close(self) -> None:
        """Free the Lua state; the script cannot be called after that."""
        self._finalizer()
        self._end = self._end or "the script is closed"
        self._phases = 0
        self._phase = self._called_back = self._remember = self._recall = self._has = self._functions = None

    def _run(self, phase: str, function: Any, *arguments: Any, near: bool = False) -> Any:
        """Call a function in Lua's thread (`near`: see there); return what it returns."""
        if self._end:
            raise self._error(phase, self._end)
        try:
            outcome = self._thread.run(function, *arguments, near=near)
        except LeftBehind:
            self._end = str(self._limit)
            raise self._error(phase, self._end) from None
        except Exception as error:  # lupa's own, or a message that cannot be handed over
            said = str(error) or type(error).__name__
            if said == "stopped":  # by a hook just before the script's beginning, or behind its end
                said = _ABOUT_MEMORY if self._values.used() > _MEMORY else str(self._limit)
            raise self._error(phase, said) from None
        finally:
            script_log.end_call()
            if not self._end and self._values.used() > _MEMORY and self._values.too_much():
                self._end = _ABOUT_MEMORY  # entered once more, lupa itself might find no room
        self._phases, how, *found = outcome if isinstance(outcome, tuple) else (outcome, True, None)
        if how is True:
            if not self._end:
                return found[0]
            how, found = _OVER_MEMORY, []
        raise self._failure(phase, how, found)

    def _failure(self, phase: str, how: Any, found: Sequence[Any]) -> ScriptError:
        """Return the error that Lua tells of: `found` holds a message, or line and file where it was stopped."""
        if how is False:
            return self._error_with_line(phase, found[0])
        if how == _TIME:
            return self._error(phase, str(self._limit), *found)
        if how == _OVER_MEMORY:
            self._end = _ABOUT_MEMORY
            return self._error(phase, self._end, *found)
        return self._error(phase, no_function(phase, ()))

    def _error(self, phase: str, message: str, line: int = 0, chunk: bytes = b"") -> ScriptError:
        return ScriptError(phase, self._helpers.path(chunk.decode("utf-8", "replace")), int(line), message)

    def _error_with_line(self, phase: str, message: bytes) -> ScriptError:
        text = message.decode("utf-8", "replace")
        if text == "not enough memory":
            return self._error(phase, _ABOUT_MEMORY)
        path, line, text = self._helpers.placed(text)
        return ScriptError(phase, path, line, text + self._hint(text))

    def _hint(self, text: str) -> str:
        """Return what a name that is nil may have been meant to be."""
        match = _NIL.search(text) if "nil value" in text else None
        if match is None:
            return ""
        name = match.group(1)
        near = near_names(name, [known for known in self._known if known.startswith("sim") == name.startswith("sim")])
        return f"; {near}" if near.startswith("near") else ""

    # ---- the API

    def _define(self, sandbox: Any, modules: Mapping[str, Api]) -> None:
        self._known: set[str] = set()
        script_globals = sandbox[b"globals"]

        def add(place: Any, name: str, shown: str, function: Function) -> None:
            self._known.add(name)
            called = _lua_function(shown, function, self._values, self._thread)
            sandbox[b"define"](place, name.encode(), shown.encode(), called)

        for api in modules.values():
            name, functions, constants = contents(api)
            table = sandbox[b"list"]()
            for known, function in functions.items():
                add(table, known, f"{name}.{known}", function)
                flat = _flat(name, known)
                add(script_globals, flat, flat, function)
            for known, constant in constants.items():
                table[known.encode()] = script_globals[f"{name}_{known}".encode()] = constant
                self._known.update((known, f"{name}_{known}"))
            script_globals[name.encode()] = sandbox[b"modules"][name.encode()] = table


def _newest() -> str:
    for dialect in _NEWEST_FIRST:
        if importlib.util.find_spec(f"lupa.{dialect}"):
            return dialect
    raise ImportError("lupa has no Lua")


def _lua_function(name: str, function: Function, values: Values, thread: Door) -> Function:
    """Return a function that answers Lua's calls; one of a script that was left behind does nothing."""
    readers, answer = values.readers(), values.answer_of(function)

    def call(how: int, *given: Any) -> tuple[Any, ...]:
        if thread.closed:
            return _STOPPED
        if values.used() > _MEMORY and values.too_much():  # or there may be no room for the answer
            return _TOO_MUCH
        arguments: Any = given
        try:
            if how:
                arguments = readers[how](given)
                if arguments is None:
                    return _AS_STREAM
            return answer(function(*arguments))
        except Exception as error:
            return FAILED, explain(name, function, arguments, error).encode("utf-8", "replace")

    thread.api_code = call.__code__
    return call


def _look(thread: Door, limit: TimeLimit, values: Values) -> Callable[[], int]:
    """Return what Lua's hook asks whether the script is to be stopped, and for what."""

    def look() -> int:
        if values.used() > _MEMORY and values.too_much():
            return _OVER_MEMORY
        return _TIME if thread.closed or limit.exceeded() else 0

    return look


def _log(thread: Door) -> Callable[[bytes], None]:
    def log(line: bytes) -> None:
        if not thread.closed:
            script_log.say(line)

    return log


def _reader(thread: Door, modules: LuaModules) -> Callable[[bytes], tuple[bool, bytes, bytes]]:
    return lambda name: (False, b"stopped", b"") if thread.closed else modules.read(name)


def _phase_functions() -> tuple[bytes, ...]:
    return tuple(f"sysCall_{phase}".encode() for phase in PHASES)


def _free(thread: Door, values: Values) -> None:
    thread.close()
    values.close()


def _flat(module: str, name: str) -> str:
    """Return the 3.x name of a function: simGetObjectPosition, simExtRosInterface_publish."""
    if module == "sim":
        return f"sim{name[:1].upper()}{name[1:]}"
    return _FLAT.get(module, module + "_") + name


def _nothing_of_python(_object: Any, name: Any, _is_setting: bool) -> Any:
    raise AttributeError(f"no access to {name!r}")
