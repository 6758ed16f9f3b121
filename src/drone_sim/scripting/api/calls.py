"""How a script's calls reach the API: every mistake becomes one line that names the function."""

from __future__ import annotations

import inspect
import itertools
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

from drone_sim.scripting.api.unknown import not_there
from drone_sim.scripting.errors import UnknownName

Function = Callable[..., Any]
_MISTAKES = (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError)
_SHOWN = 60  # characters of a value
_MOST = 13  # values
_LONGEST = 1000  # characters of an error's message


class Api:
    """The functions and constants of one module, such as `sim`, as the attributes that a Python script uses."""

    def __init__(
        self,
        name: str,
        functions: Mapping[str, Function],
        constants: Mapping[str, Any],
        remember: Callable[[], Callable[[], None]] | None = None,
    ):
        """Take what it is called, and what it has.

        `remember` returns what brings back what a script has set in it, and that is nowhere else.
        """
        self.__dict__.update(constants)
        self.__dict__.update(functions)
        # Kept out of sight: whatever else is an attribute is the script's to use.
        self.__dict__["_api"] = (name, dict(functions), dict(constants), remember)

    def __getattr__(self, name: str) -> Any:
        """Raise UnknownName, with the near names; called for what is not there."""
        own, functions, constants, _ = self.__dict__["_api"]
        raise UnknownName(not_there(f"{own}.", name, [*functions, *constants]))


def contents(api: Api) -> tuple[str, dict[str, Function], dict[str, Any]]:
    """Return name, functions and constants of an API."""
    name, functions, constants, _ = api.__dict__["_api"]
    return name, functions, constants


def remember(apis: Iterable[Api]) -> list[Callable[[], None]]:
    """Return functions that bring back what a script has set in its APIs."""
    remembering = (api.__dict__["_api"][3] for api in apis)
    return [one() for one in remembering if one is not None]


def public_functions(parts: Iterable[object]) -> dict[str, Function]:
    """Return the public methods of some objects, by name."""
    return {
        name: getattr(part, name)
        for part in parts
        for name in dir(part)
        if not name.startswith("_") and callable(getattr(part, name))
    }


def mistake(error: BaseException, apis: Iterable[Api]) -> str | None:
    """Return one line on an error that a call of an API raised in a Python script; None for any other error.

    Looked up afterwards, in the traceback: a guard around every function would cost every call.
    """
    if not isinstance(error, _MISTAKES):
        return None
    functions = [(f"{contents(api)[0]}.{known}", one) for api in apis for known, one in contents(api)[1].items()]
    by_code = {one.__code__: (name, one) for name, one in reversed(functions)}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        if frame.f_code in by_code:
            name, function = by_code[frame.f_code]
            parameters = inspect.signature(function).parameters.values()
            given = [frame.f_locals[one.name] for one in parameters if one.kind is not one.VAR_POSITIONAL]
            return explain(name, function, given, error)
    for name, function in functions:
        if str(error).startswith(f"{function.__qualname__}() "):  # never got inside
            return f"{name}: wrong number of values, expected ({_expected(inspect.signature(function))})"
    return None


def explain(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return one line: what is wrong, what came, what is expected."""
    if isinstance(error, ValueError):
        return f"{name}: {str(error)[:_LONGEST]}"
    signature = inspect.signature(function)
    try:
        signature.bind(*arguments)
        reason = str(error) if isinstance(error, WrongValue) else "wrong kind of value"
    except TypeError:
        reason = "wrong number of values"
    came = ", ".join(show(value) for value in arguments[:_MOST])
    return f"{name}: {reason}: got ({came}), expected ({_expected(signature)})"


def _expected(signature: inspect.Signature) -> str:
    """Return 'handle: Handle, relativeTo: Handle = -1'."""
    shown = []
    for parameter in signature.parameters.values():
        text = f"{parameter.name}: {parameter.annotation}"
        if parameter.kind is parameter.VAR_POSITIONAL:
            continue
        shown.append(text if parameter.default in (parameter.empty, ()) else f"{text} = {show(parameter.default)}")
    return ", ".join(shown)


def show(value: Any, depth: int = 0) -> str:
    """Return a value as a message shows it: short, on one line, whatever it is."""
    try:
        text = _shown(value, depth)
    except Exception:
        text = f"a {type(value).__name__}"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def _shown(value: Any, depth: int) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, (str, bytes)):
        return repr(value[:_SHOWN])
    if isinstance(value, (list, tuple)):
        inner = ", ".join(show(item, depth + 1) for item in value[:_MOST]) if depth < 2 else "..."
        return f"[{inner}]"
    if isinstance(value, Mapping):
        some = itertools.islice(value.items(), _MOST) if depth < 2 else ()
        return "{" + ", ".join(f"{show(key, 2)}: {show(item, depth + 1)}" for key, item in some) + "}"
    return repr(value)


class WrongValue(TypeError):
    """A value is of the wrong kind; the message says what is expected instead."""


def numbers(values: Sequence[float], count: int) -> tuple[float, ...]:
    """Return `count` finite numbers; raises WrongValue."""
    if type(values) is list and len(values) == count:  # most often what another call returned
        try:
            total = sum(values)
        except TypeError:
            total = None
        if type(total) is float and isfinite(total):
            return tuple(values)
    expected = f"{count} numbers are expected" if count != 1 else "a number is expected"
    try:
        found = tuple(map(float, values))
    except OverflowError:  # a whole number beyond all floats
        raise WrongValue("finite numbers are expected") from None
    except (TypeError, ValueError):
        raise WrongValue(expected) from None
    if len(found) != count:
        raise WrongValue(f"{expected}, not {len(found)}")
    if not isfinite(sum(found)):
        raise WrongValue("finite numbers are expected")
    return found
