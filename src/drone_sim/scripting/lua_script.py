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
from pathlib import Path
from typing import Any, Callable, Dict, Mapping, Optional, Set

from drone_sim.objects import near_names
from drone_sim.scripting.api_scripts import LOG
from drone_sim.scripting.calls import Api, Function, contents, explain
from drone_sim.scripting.constants import CALL_TYPES, PHASES
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.lua_sandbox import PRELUDE
from drone_sim.scripting.lua_values import Values
from drone_sim.scripting.messages import Callback
from drone_sim.scripting.time_limit import TimeLimit

_LOG = logging.getLogger(__name__)
_MEMORY = 256 * 1024 * 1024  # bytes that a script may use
_NEWEST_FIRST = ("lua55", "lua54", "lua53", "lua52", "lua51")
_FLAT = {"sim": "sim", "simROS": "simExtRosInterface_"}  # 3.x: simGetObjectPosition, simExtRosInterface_publish

_COMMENT = re.compile(rb"--\[(=*)\[.*?\]\1\]|--[^\n]*", re.DOTALL)
_PER_PHASE = re.compile(rb"\bsim_call_type\b")
_FLAT_CALL = re.compile(rb"(?<![.:\w])sim[A-Z]\w*\s*\(")
_NIL = re.compile(r"(?:field|global|method) '(\w+)'")
_NAME_LENGTH = 50  # Lua cuts longer chunk names


class LuaScript:
    """A file that defines sysCall_init, ... as it needs them, or looks at sim_call_type."""

    def __init__(self, path: str, modules: Mapping[str, Api], limit: TimeLimit):
        """Compile the file; run its top level unless it is to run in every phase. Raises ScriptError."""
        self._path = path
        self._limit = limit
        source = Path(path).read_bytes()
        if source.startswith(b"#"):
            source = b"--" + source
        bare = _COMMENT.sub(b" ", source)
        self._per_phase = _PER_PHASE.search(bare) is not None
        self._name = Path(path).name[:_NAME_LENGTH]
        self._open("lua51" if self._per_phase or _FLAT_CALL.search(bare) else _newest())
        self._define(modules)
        self._chunk = self._compile(source)
        if not self._per_phase:
            self._run("load", self._chunk)

    def _open(self, dialect: str) -> None:
        lupa = importlib.import_module(f"lupa.{dialect}")
        runtime = lupa.LuaRuntime(
            encoding=None,
            register_eval=False,
            register_builtins=False,
            attribute_filter=_nothing_of_python,
            unpack_returned_tuples=True,
            max_memory=_MEMORY,
        )
        self._values = Values(runtime, lupa.lua_type)
        # What Lua holds of Python must not lead back to this object, or neither is ever freed.
        self._finalizer = weakref.finalize(self, self._values.close)
        chunk_name = f"={self._name}".encode()
        sandbox = runtime.execute(PRELUDE.encode(), self._limit.exceeded, _log, chunk_name)
        self._values.use(sandbox)
        self._sandbox = sandbox
        self._call, self._find = sandbox[b"run"], sandbox[b"find"]
        self._globals = sandbox[b"globals"]
        _LOG.debug("%s runs in %s", self._path, dialect)

    # ---- the script

    def call(self, phase: str) -> None:
        """Run a phase; raises ScriptError."""
        if self._per_phase:
            self._globals[b"sim_call_type"] = CALL_TYPES[phase]
            self._run(phase, self._chunk)
            return
        function = self._find(_FUNCTIONS[phase])
        if function is not None:
            self._run(phase, function)

    def callback(self, callback: Callback, message: Any) -> None:
        """Call the script's function of that name with a message; raises ScriptError."""
        function = self._find(callback.encode() if isinstance(callback, str) else callback)
        if function is None:
            raise ScriptError(str(callback), self._path, 0, f"the script has no function '{callback}' to call back")
        self._run(callback if isinstance(callback, str) else "callback", function, self._values.to_lua(message))

    def remember(self) -> Callable[[], None]:
        """Return a function that gives the script's variables the values that they have now."""
        return self._sandbox[b"remember"]()

    def close(self) -> None:
        """Free the Lua state; the script cannot be called after that."""
        self._finalizer()
        self._sandbox = self._call = self._find = self._globals = self._chunk = None

    def _compile(self, source: bytes) -> Any:
        compiled = self._sandbox[b"compile"](source, f"={self._name}".encode())
        if isinstance(compiled, tuple):
            raise self._error("load", None, compiled[1])
        return compiled

    def _run(self, phase: str, function: Any, *arguments: Any) -> None:
        self._limit.start()
        try:
            outcome = self._call(function, *arguments)
        except Exception as error:  # lupa's own, such as a stack overflow in C
            raise ScriptError(phase, self._path, 0, f"{type(error).__name__}: {error}") from None
        if outcome is not True:
            raise self._error(phase, *outcome[1:])

    def _error(self, phase: str, line: Optional[int], message: Optional[bytes] = None) -> ScriptError:
        if message is None:
            return ScriptError(phase, self._path, int(line or 0), str(self._limit))
        text = message.decode("utf-8", "replace")
        match = re.match(rf"{re.escape(self._name)}:(\d+): (.*)$", text, re.DOTALL)
        found, text = (int(match.group(1)), match.group(2)) if match else (0, text)
        return ScriptError(phase, self._path, found, text + self._hint(text))

    def _hint(self, text: str) -> str:
        """Return what a name that is nil may have been meant to be."""
        match = _NIL.search(text) if "nil value" in text else None
        if match is None:
            return ""
        name = match.group(1)
        near = near_names(name, [known for known in self._known if known.startswith("sim") == name.startswith("sim")])
        return f"; {near}" if near.startswith("near") else ""

    # ---- the API

    def _define(self, modules: Mapping[str, Api]) -> None:
        self._known: Set[str] = set()
        for api in modules.values():
            name, functions, constants = contents(api)
            table = self._sandbox[b"list"]()
            for known, function in functions.items():
                self._add(table, known, f"{name}.{known}", function)
                flat = _FLAT.get(name, name + "_")
                self._add(self._globals, flat + (_capital(known) if flat == "sim" else known), "", function)
            for known, constant in constants.items():
                table[known.encode()] = self._globals[f"{name}_{known}".encode()] = constant
                self._known.update((known, f"{name}_{known}"))
            self._globals[name.encode()] = self._sandbox[b"modules"][name.encode()] = table

    def _add(self, place: Any, name: str, shown: str, function: Function) -> None:
        self._known.add(name)
        self._sandbox[b"define"](place, name.encode(), _lua_function(shown or name, function, self._values))


_FUNCTIONS: Dict[str, bytes] = {phase: f"sysCall_{phase}".encode() for phase in PHASES}


def _newest() -> str:
    for dialect in _NEWEST_FIRST:
        if importlib.util.find_spec(f"lupa.{dialect}"):
            return dialect
    raise ImportError("lupa has no Lua")


def _lua_function(name: str, function: Function, values: Values) -> Function:
    """Return a function that gives Lua (true, results...) or (false, message)."""

    def call(*given: Any) -> Any:
        arguments: Any = given
        try:
            arguments = values.arguments(given)
            return (True, *values.results(function(*arguments)))
        except Exception as error:
            return False, explain(name, function, arguments, error).encode("utf-8")

    return call


def _log(line: bytes) -> None:
    LOG.info("%s", line.decode("utf-8", "replace"))


def _capital(name: str) -> str:
    return name[:1].upper() + name[1:]


def _nothing_of_python(_object: Any, name: Any, _is_setting: bool) -> Any:
    raise AttributeError(f"no access to {name!r}")
