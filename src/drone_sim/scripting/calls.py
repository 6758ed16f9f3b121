"""How a script's calls reach the API: every mistake becomes one line that names the function."""

from __future__ import annotations

import inspect
import math
from typing import Any, Callable, Dict, Iterable, Mapping, Sequence, Tuple

from drone_sim.objects import near_names
from drone_sim.scripting.errors import ApiError, UnknownName

Function = Callable[..., Any]
_MISTAKES = (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError)
_SHOWN = 60  # characters of a value


class Api:
    """The functions and constants of one module, such as `sim`, as the attributes that a Python script uses."""

    def __init__(self, name: str, functions: Mapping[str, Function], constants: Mapping[str, Any]):
        """Take what it is called, and what it has."""
        self.__dict__.update(constants)
        self.__dict__.update({known: guarded(f"{name}.{known}", function) for known, function in functions.items()})
        # Kept out of sight: whatever else is an attribute is the script's to use.
        self.__dict__["_api"] = (name, dict(functions), dict(constants))

    def __getattr__(self, name: str) -> Any:
        """Raise UnknownName, with the near names; called for what is not there."""
        own, functions, constants = self.__dict__["_api"]
        raise UnknownName(f"{own} has no '{name}'; {near_names(name, [*functions, *constants])}")


def contents(api: Api) -> Tuple[str, Dict[str, Function], Dict[str, Any]]:
    """Return name, functions (not guarded) and constants of an API."""
    name, functions, constants = api.__dict__["_api"]
    return name, functions, constants


def public_functions(parts: Iterable[object]) -> Dict[str, Function]:
    """Return the public methods of some objects, by name."""
    return {
        name: getattr(part, name)
        for part in parts
        for name in dir(part)
        if not name.startswith("_") and callable(getattr(part, name))
    }


def guarded(name: str, function: Function) -> Function:
    """Return the function with its errors turned into ApiError."""

    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except _MISTAKES as error:
            raise ApiError(explain(name, function, (*arguments, *named.values()), error)) from error

    call.__name__ = name.rpartition(".")[2]
    call.__doc__ = function.__doc__
    return call


def explain(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return one line: what is wrong, what came, what is expected."""
    if isinstance(error, ValueError):
        return f"{name}: {error}"
    signature = inspect.signature(function)
    try:
        signature.bind(*arguments)
        reason = str(error) if isinstance(error, WrongValue) else "wrong kind of value"
    except TypeError:
        reason = "wrong number of values"
    came = ", ".join(show(value) for value in arguments)
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


def show(value: Any) -> str:
    """Return a value as a message shows it: short, on one line."""
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, (list, tuple)):
        text = "[" + ", ".join(show(item) for item in value[:13]) + "]"
    elif value is None:
        return "nothing"
    else:
        text = repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


class WrongValue(TypeError):
    """A value is of the wrong kind; the message says what is expected instead."""


def numbers(values: Sequence[float], count: int) -> Tuple[float, ...]:
    """Return `count` finite numbers; raises WrongValue."""
    try:
        found = tuple(map(float, values))
    except (TypeError, ValueError):
        raise WrongValue(f"{count} numbers are expected") from None
    if len(found) != count:
        raise WrongValue(f"{count} numbers are expected, not {len(found)}")
    if not math.isfinite(sum(found)):
        raise WrongValue("finite numbers are expected")
    return found
