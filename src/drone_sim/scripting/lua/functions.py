"""Definition of the API's functions in a Lua state."""

from __future__ import annotations

import functools
from collections.abc import Callable, Generator, Mapping, Set
from typing import Any

from drone_sim.scripting.api.calls import Api, Function, contents, explain, flat_name, most_values
from drone_sim.scripting.api.control import Wait, waits
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.lua.state import MEMORY, LuaState
from drone_sim.scripting.lua.values import AS_STREAM, FAILED, PLAIN, TOO_MUCH
from drone_sim.scripting.script_log import LOG

_MOST_WAITS = 1000  # limited because Lua does not count their memory
_AS_STREAM, _TOO_MUCH, _STOPPED = (AS_STREAM,), (TOO_MUCH,), (FAILED, b"stopped")


def define(state: LuaState, modules: Mapping[str, Api]) -> set[str]:
    """Define the API's modules, and the functions with flat names, as globals of the script; return all names."""
    known: set[str] = set()
    sandbox = state.sandbox
    script_globals = sandbox[b"globals"]

    def add(place: Any, name: str, shown: str, function: Function) -> None:
        known.add(name)
        wrapped = lua_function(shown, function, state)
        sandbox[b"define"](place, name.encode(), shown.encode(), wrapped, waits(function))

    for api in modules.values():
        module, functions, constants = contents(api)
        table = state.runtime.table()
        for name, function in functions.items():
            add(table, name, f"{module}.{name}", function)
            flat = flat_name(module, name)
            add(script_globals, flat, flat, function)
            known.add(flat)
        for name, constant in constants.items():
            value = state.values.to_lua(constant)
            table[name.encode()] = script_globals[f"{module}_{name}".encode()] = value
            known.update((name, f"{module}_{name}"))
        sandbox[b"guard"](table, _why_not(f"{module}.", {*functions, *constants}))
        script_globals[module.encode()] = sandbox[b"modules"][module.encode()] = table
    sandbox[b"guard"](script_globals, _why_not("", {name for name in known if name.startswith("sim")}))
    return known


def _why_not(prefix: str, known: Set[str]) -> Callable[[bytes], bytes | None]:
    """Return a function that returns the message for an unknown name; None for a plugin, which scripts may look up."""

    def why(name: bytes) -> bytes | None:
        text = name.decode("utf-8", "replace")
        return None if not prefix and text in PLUGINS else not_there(prefix, text, known).encode("utf-8", "replace")

    return why


def lua_function(name: str, function: Function, state: LuaState) -> Function:
    """Return a function that Lua can call instead of `function`; it does nothing in a script that was abandoned."""
    executor, readers, encode = state.executor, state.values.readers(), state.values.encoder_of(function)
    if waits(function):
        encode = functools.partial(_wait_function, name, state)

    def call(form: int, *values: Any) -> tuple[Any, ...]:
        if executor.closed:
            return _STOPPED
        if state.used() > MEMORY and state.too_much():  # otherwise memory may be missing for the result
            return _TOO_MUCH
        arguments: Any = values
        try:
            if form:
                arguments = readers[form](values)
                if arguments is None:
                    return _AS_STREAM
            return encode(function(*arguments))
        except Exception as error:
            return _handle_error(name, function, arguments, error, call, state)

    executor.api_code = call.__code__
    return call


def _handle_error(
    name: str, function: Function, arguments: Any, error: Exception, call: Function, state: LuaState
) -> tuple[Any, ...]:
    """Return the error for Lua. After too many arguments, repeat the call without the surplus ones, as V-REP does."""
    most = most_values(function)
    if len(arguments) <= most:
        return FAILED, explain(name, function, arguments, error).encode("utf-8", "replace")
    if name not in state.warned:
        state.warned.add(name)
        LOG.info("%s: got %d values and uses %d: the others are ignored", name, len(arguments), most)
    result: tuple[Any, ...] = call(0, *arguments[:most])
    return result


def _wait_function(name: str, state: LuaState, wait: Wait) -> tuple[Any, ...]:
    """Return a function that Lua calls in each step; it returns whether to wait longer, and the result.

    If Lua must first call one of the script's own functions, the function and its arguments follow after `true`, and
    the next call passes whether the function has returned true.
    """
    if state.waits >= _MOST_WAITS:
        state.runtime.gccollect()  # frees the waits of coroutines that do not exist any more
    if state.waits >= _MOST_WAITS:
        raise ValueError(f"at most {_MOST_WAITS} coroutines of a script may wait at once")
    steps = _steps(wait, state)

    def advance(answer: Any = None) -> tuple[Any, ...]:
        return steps.send(answer)

    return PLAIN, lua_function(name, advance, state)


def _steps(wait: Wait, state: LuaState) -> Generator[tuple[Any, ...], Any, None]:
    state.waits += 1
    steps, answer = iter(wait), None
    try:
        while True:
            try:
                call = steps.send(answer)
            except StopIteration:
                break
            answer = yield (True, call.callback, *call.arguments) if call else (True,)
    finally:
        state.waits -= 1
    value = wait.value()
    yield (False, *value) if isinstance(value, tuple) else (False, value)
