"""The API's functions as a Lua script calls them."""

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

_MOST_WAITS = 1000  # which Lua does not count as memory
_AS_STREAM, _TOO_MUCH, _STOPPED = (AS_STREAM,), (TOO_MUCH,), (FAILED, b"stopped")


def define(state: LuaState, modules: Mapping[str, Api]) -> set[str]:
    """Put modules of the API among the script's globals, with their flat names, too; return every name."""
    known: set[str] = set()
    sandbox = state.sandbox
    script_globals = sandbox[b"globals"]

    def add(place: Any, name: str, shown: str, function: Function) -> None:
        known.add(name)
        called = lua_function(shown, function, state)
        sandbox[b"define"](place, name.encode(), shown.encode(), called, waits(function))

    for api in modules.values():
        module, functions, constants = contents(api)
        table = state.runtime.table()
        for name, function in functions.items():
            add(table, name, f"{module}.{name}", function)
            flat = flat_name(module, name)
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


def lua_function(name: str, function: Function, state: LuaState) -> Function:
    """Return a function that answers Lua's calls; one of a script that was left behind does nothing."""
    executor, readers, answer = state.executor, state.values.readers(), state.values.answer_of(function)
    if waits(function):
        answer = functools.partial(_asked_in_steps, name, state)

    def call(how: int, *given: Any) -> tuple[Any, ...]:
        if executor.closed:
            return _STOPPED
        if state.used() > MEMORY and state.too_much():  # or there may be no room for the answer
            return _TOO_MUCH
        arguments: Any = given
        try:
            if how:
                arguments = readers[how](given)
                if arguments is None:
                    return _AS_STREAM
            return answer(function(*arguments))
        except Exception as error:
            return _failed(name, function, arguments, error, call, state)

    executor.api_code = call.__code__
    return call


def _failed(
    name: str, function: Function, arguments: Any, error: Exception, call: Function, state: LuaState
) -> tuple[Any, ...]:
    """Answer with what went wrong; or, as V-REP does, by a call without what the function does not take."""
    most = most_values(function)
    if len(arguments) <= most:
        return FAILED, explain(name, function, arguments, error).encode("utf-8", "replace")
    if name not in state.lavish:
        state.lavish.add(name)
        LOG.info("%s: got %d values and uses %d: the others are ignored", name, len(arguments), most)
    answered: tuple[Any, ...] = call(0, *arguments[:most])
    return answered


def _asked_in_steps(name: str, state: LuaState, wait: Wait) -> tuple[Any, ...]:
    """Answer with a function that Lua calls once a step: it returns whether to wait, and what the wait has brought.

    If one of the script's own functions is to be called first, it and its arguments follow after whether to wait, and
    the next call tells whether that function has returned true.
    """
    if state.waits >= _MOST_WAITS:
        state.runtime.gccollect()  # those of coroutines that are no more
    if state.waits >= _MOST_WAITS:
        raise ValueError(f"at most {_MOST_WAITS} coroutines of a script may wait at once")
    steps = _steps(wait, state)

    def waited(answer: Any = None) -> tuple[Any, ...]:
        return steps.send(answer)

    return PLAIN, lua_function(name, waited, state)


def _steps(wait: Wait, state: LuaState) -> Generator[tuple[Any, ...], Any, None]:
    state.waits += 1
    steps, answer = iter(wait), None
    try:
        while True:
            try:
                asked = steps.send(answer)
            except StopIteration:
                break
            answer = yield (True, asked.callback, *asked.arguments) if asked else (True,)
    finally:
        state.waits -= 1
    value = wait.value()
    yield (False, *value) if isinstance(value, tuple) else (False, value)
