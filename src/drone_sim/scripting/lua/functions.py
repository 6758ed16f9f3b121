"""The API's functions as a Lua script calls them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from typing import Any

from drone_sim.scripting.api.calls import Api, Function, contents, explain
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.lua.thread import Door
from drone_sim.scripting.lua.values import AS_STREAM, FAILED, MEMORY, TOO_MUCH, Values

_FLAT = {"simROS": "simExtRosInterface_"}
_AS_STREAM, _TOO_MUCH, _STOPPED = (AS_STREAM,), (TOO_MUCH,), (FAILED, b"stopped")


def define(runtime: Any, sandbox: Any, modules: Mapping[str, Api], values: Values, door: Door) -> set[str]:
    """Put modules of the API among the script's globals, with their flat names, too; return every name."""
    known: set[str] = set()
    script_globals = sandbox[b"globals"]

    def add(place: Any, name: str, shown: str, function: Function) -> None:
        known.add(name)
        called = lua_function(shown, function, values, door)
        sandbox[b"define"](place, name.encode(), shown.encode(), called)

    for api in modules.values():
        module, functions, constants = contents(api)
        table = runtime.table()
        for name, function in functions.items():
            add(table, name, f"{module}.{name}", function)
            flat = _flat(module, name)
            add(script_globals, flat, flat, function)
            known.add(flat)
        for name, constant in constants.items():
            table[name.encode()] = script_globals[f"{module}_{name}".encode()] = constant
            known.update((name, f"{module}_{name}"))
        sandbox[b"guard"](table, _why_not(f"{module}.", {*functions, *constants}))
        script_globals[module.encode()] = sandbox[b"modules"][module.encode()] = table
    sandbox[b"guard"](script_globals, _why_not("", {name for name in known if name.startswith("sim")}))
    return known


def _why_not(prefix: str, known: Set[str]) -> Callable[[bytes], bytes | None]:
    """Return what says why a name is not there; nothing for a plugin that a script may ask for."""

    def why(name: bytes) -> bytes | None:
        text = name.decode("utf-8", "replace")
        return None if not prefix and text in PLUGINS else not_there(prefix, text, known).encode("utf-8", "replace")

    return why


def lua_function(name: str, function: Function, values: Values, door: Door) -> Function:
    """Return a function that answers Lua's calls; one of a script that was left behind does nothing."""
    readers, answer = values.readers(), values.answer_of(function)

    def call(how: int, *given: Any) -> tuple[Any, ...]:
        if door.closed:
            return _STOPPED
        if values.used() > MEMORY and values.too_much():  # or there may be no room for the answer
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

    door.api_code = call.__code__
    return call


def _flat(module: str, name: str) -> str:
    """Return the 3.x name of a function: simGetObjectPosition, simExtRosInterface_publish."""
    if module == "sim":
        return f"sim{name[:1].upper()}{name[1:]}"
    return _FLAT.get(module, module + "_") + name
