"""Loading of child scripts from .py and .lua files."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path

from drone_sim.files.resources import resolve
from drone_sim.message_text import near_names
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.breakpoints import Breakpoints
from drone_sim.scripting.errors import ScriptError, read_source
from drone_sim.scripting.python.helpers import BUILT_IN
from drone_sim.scripting.python.script import PythonScript
from drone_sim.scripting.time_limit import TimeLimit

_ENDINGS = (".py", ".lua")
DEFAULT = "pilot"
NO_SCRIPT = "none"  # the script of a vehicle that only other scripts or clients fly


Loader = Callable[..., Script]  # as `load` below


@functools.cache
def no_script() -> Script:
    """Return the script of a drone before one is loaded: an empty one."""
    return PythonScript("", b"", {}, TimeLimit(0.0), Turns())


def script_path(script: str) -> str:
    """Return the path of a script: a file, a package:// address, or the name of a built-in script.

    '' means the pilot. Raises ScriptError.
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


@functools.cache  # called several times for every flight
def _built_in() -> dict[str, str]:
    return {path.stem: str(path) for path in BUILT_IN.glob("*") if path.suffix in _ENDINGS and path.stem != "__init__"}


def load(
    script: str,
    modules: Mapping[str, Api],
    limit: TimeLimit,
    turns: Turns | None = None,
    breakpoints: Breakpoints | None = None,
    customizes: bool = False,
) -> Script:
    """Load a script. `turns` switch its thread; `breakpoints` are those of all scripts. Raises ScriptError.

    `customizes`: whether it is a customization script.
    """
    path = script_path(script)
    try:
        source = read_source(path)
    except ValueError as error:
        raise ScriptError("load", path, 0, str(error)) from None
    if path.endswith(".py"):
        return PythonScript(path, source, modules, limit, turns or Turns(), breakpoints, customizes)
    try:
        from drone_sim.scripting.lua.script import LuaScript  # imported here because Python scripts do not need lupa

        return LuaScript(path, source, modules, limit, breakpoints, customizes)
    except ImportError as error:
        raise ScriptError("load", path, 0, f"Lua scripts need lupa (pip install lupa): {error}") from None
