"""Child scripts by file: .py and .lua behind one interface."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, Protocol

from drone_sim.files.resources import resolve
from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError, read_source
from drone_sim.scripting.python.helpers import BUILT_IN
from drone_sim.scripting.python.script import PythonScript
from drone_sim.scripting.time_limit import TimeLimit

_ENDINGS = (".py", ".lua")
DEFAULT = "pilot"
NO_SCRIPT = "none"  # what a vehicle says that has none, for others to fly it: the one that is given, or a client


class Script(Protocol):
    """A child script that is loaded."""

    language: str  # lua or python
    idle: str  # why none of its phases is ever called, '' where one is
    is_empty: bool
    flat_names: Collection[str]  # functions that it calls by their names of 3.x

    @property
    def threaded(self) -> bool:
        """Whether it has a thread that has not ended."""

    def call(self, phase: str) -> None:
        """Run a phase: init, actuation, sensing or cleanup. Raises ScriptError."""

    def take_turn(self) -> None:
        """Let its thread run until it is left; raises ScriptError."""

    def defines(self, name: str) -> bool:
        """Return whether the script's own file defines a global function of this name. Raises ScriptError."""

    def call_function(self, name: str, arguments: list[Any]) -> Any:
        """Call a global function with values; return None, a value or a tuple of several. Raises ScriptError."""

    def call_own(self, name: str, arguments: list[Any]) -> Any:
        """Do the same when the script calls itself: the time counts for its present call. Raises ScriptError."""

    def execute(self, text: str) -> Any:
        """Run a text in the script; return None, a value or a tuple of several. Raises ScriptError."""

    def execute_own(self, text: str) -> Any:
        """Do the same when the script calls itself: the time counts for its present call. Raises ScriptError."""

    def callback(self, callback: Callback, message: Any) -> None:
        """Call a function of the script with a message. Raises ScriptError."""

    def answer(self, callback: Callback, request: Any) -> Any:
        """Call a function of the script with a request; return what it returns. Raises ScriptError."""

    def check(self, callback: Callback) -> None:
        """Raise ScriptError where the script has no such function to call back."""

    def follow_breakpoints(self) -> None:
        """Look at the lines that have breakpoints by now, or at none."""

    def variables(self) -> list[Scope]:
        """Return its variables, as a person reads them; none where it cannot be called any more."""

    def save_state(self) -> Callable[[], None]:
        """Return a function that gives the script's variables the values that they have now."""

    def close(self) -> None:
        """Free what the script holds; may be called twice."""


Loader = Callable[[str, Mapping[str, Api], TimeLimit, Turns, "Breakpoints | None"], Script]  # as `load` below


@functools.cache
def no_script() -> Script:
    """Return what a drone has before a script is loaded: an empty one."""
    return PythonScript("", b"", {}, TimeLimit(0.0), Turns())


def script_path(script: str) -> str:
    """Return the path of a script: a file, a package:// address, or the name of a built-in one.

    '' is the pilot's. Raises ScriptError.
    """
    name = script or DEFAULT
    if "/" not in name and not Path(name).suffix:
        known = _built_in()
        if name not in known:
            raise ScriptError("load", name, 0, f"there is no built-in script with this name; {near_names(name, known)}")
        return known[name]
    if Path(name).suffix not in _ENDINGS:
        raise ScriptError("load", name, 0, "the name of a child script must end in .py or .lua")
    try:
        return str(resolve(name))
    except FileNotFoundError as error:
        raise ScriptError("load", name, 0, str(error)) from None


@functools.cache  # asked several times for every flight
def _built_in() -> dict[str, str]:
    """Return the paths of the built-in scripts, by name."""
    return {path.stem: str(path) for path in BUILT_IN.glob("*") if path.suffix in _ENDINGS and path.stem != "__init__"}


def load(
    script: str,
    modules: Mapping[str, Api],
    limit: TimeLimit,
    turns: Turns | None = None,
    breakpoints: Breakpoints | None = None,
) -> Script:
    """Load a child script, whose thread has those `turns`, and all scripts those `breakpoints`; raises ScriptError."""
    path = script_path(script)
    try:
        source = read_source(path)
    except ValueError as error:
        raise ScriptError("load", path, 0, str(error)) from None
    if path.endswith(".py"):
        return PythonScript(path, source, modules, limit, turns or Turns(), breakpoints)
    try:
        from drone_sim.scripting.lua.script import LuaScript  # whoever flies Python needs no lupa

        return LuaScript(path, source, modules, limit, breakpoints)
    except ImportError as error:
        raise ScriptError("load", path, 0, f"Lua scripts need lupa (pip install lupa): {error}") from None
