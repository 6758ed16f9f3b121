"""Declaration of the script API's functions, and error messages for calls of them.

A decorator declares a function once for Lua, Python, the remote API and docs/api.md, with the name of its module, and
its names in each generation of V-REP:

    @sim("5", getInt32Parameter="34")
    def getInt32Param(self, parameter: int) -> int:
        ...

Error messages name the expected arguments by their annotations. docs/api.md has a section for each class and shows the
docstrings.
"""

from __future__ import annotations

import functools
import inspect
import itertools
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from drone_sim.scripting.api.types import WrongValue
from drone_sim.scripting.api.unknown import not_there

Function = Callable[..., Any]
_Method = TypeVar("_Method", bound=Function)
_FLAT = {
    "sim": "sim",
    "simROS": "simExtRosInterface_",
    "simUI": "simExtCustomUI_",
    "simVision": "simExtVision_",
    "simOMPL": "simExtOMPL_",
}  # prefixes of V-REP 3.x names
_MISTAKES = (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError)
_SHOWN = 60  # characters of a value
_MOST = 13  # values
_LONGEST = 1000  # characters of an error's message


@dataclass(frozen=True)
class Declaration:
    """Module and names of a function in the API.

    names: its names for scripts, its own name first, each with the generations of V-REP that have it: 3 for 3.x, 4 for
    4.0 to 4.2, 5 for 4.3 and later, such as "45"; '' if only drone_sim has it.
    """

    module: str
    names: Mapping[str, str]


class Module:
    """Decorator factory that declares functions of one API module, by an attribute `declaration`."""

    def __init__(self, name: str):
        self._name = name

    def __call__(self, generations: str = "345", **others: str) -> Callable[[_Method], _Method]:
        """Return a decorator. `generations` have the function's own name; `others` are other names and generations."""

        def declare(function: _Method) -> _Method:
            names = {function.__name__: generations, **others}
            function.declaration = Declaration(self._name, names)  # type: ignore[attr-defined]
            return function

        return declare

    def add(self, to: type, function: Function, name: str, doc: str, generations: str = "345", **others: str) -> None:
        """Declare a generated function and add it to the class `to`, with a name and docstring."""
        function.__name__, function.__qualname__, function.__doc__ = name, f"{to.__name__}.{name}", doc
        setattr(to, name, self(generations, **others)(function))


sim, simROS = Module("sim"), Module("simROS")


def declaration_of(function: Function) -> Declaration | None:
    """Return the declaration of a function, None if it has none."""
    return getattr(function, "declaration", None)


def methods_of(kind: type) -> Iterator[tuple[Function, str, list[str]]]:
    """Yield the declared methods of a class, each with its own name and all names of its function, as module.name."""
    for method in vars(kind).values():
        declaration = declaration_of(method)
        if declaration is not None:
            module = declaration.module
            yield method, f"{module}.{method.__name__}", [f"{module}.{name}" for name in declaration.names]


def functions_of(*parts: object) -> dict[str, Function]:
    """Return the declared methods of some objects, under each of their names."""
    found: dict[str, Function] = {}
    for part in parts:
        for attribute, names in _declared_in(type(part)):  # type: ignore[arg-type] # a class has a hash
            found.update(dict.fromkeys(names, getattr(part, attribute)))
    return found


@functools.cache
def _declared_in(kind: type) -> list[tuple[str, Mapping[str, str]]]:
    """Return the declared methods of a class, each with its names in the API."""
    declared = ((attribute, declaration_of(getattr(kind, attribute))) for attribute in dir(kind))
    return [(attribute, declaration.names) for attribute, declaration in declared if declaration is not None]


def flat_name(module: str, name: str) -> str:
    """Return the V-REP 3.x name of a function: simGetObjectPosition, simExtRosInterface_publish."""
    return _FLAT.get(module, f"{module}_") + (f"{name[:1].upper()}{name[1:]}" if module == "sim" else name)


class UnknownName(AttributeError):
    """Access to a function or constant that the API does not have."""


class Api:
    """A module such as `sim`, with its functions and constants as attributes for Python scripts."""

    def __init__(
        self,
        name: str,
        functions: Mapping[str, Function],
        constants: Mapping[str, Any],
        save_state: Callable[[], Callable[[], None]] | None = None,
    ):
        """`name` is its name for scripts.

        `save_state` returns a function that restores the values that a script has set, if they are stored only here.
        """
        self.__dict__.update(constants)
        self.__dict__.update(functions)
        # In a single attribute, because scripts may use all other names.
        self.__dict__["_api"] = (name, dict(functions), dict(constants), save_state)

    def __getattr__(self, name: str) -> Any:
        """Raise UnknownName with similar names; Python calls this for missing attributes."""
        own, functions, constants, _ = self.__dict__["_api"]
        raise UnknownName(not_there(f"{own}.", name, [*functions, *constants]))


def contents(api: Api) -> tuple[str, dict[str, Function], dict[str, Any]]:
    """Return name, functions and constants of an API module."""
    name, functions, constants, _ = api.__dict__["_api"]
    return name, functions, constants


def save_state(apis: Iterable[Api]) -> list[Callable[[], None]]:
    """Return functions that restore the values that a script has set in its API modules."""
    functions = (api.__dict__["_api"][3] for api in apis)
    return [function() for function in functions if function is not None]


def mistake(error: BaseException, apis: Iterable[Api]) -> str | None:
    """Return a one-line message for an error raised by an API call in a Python script; None for any other error.

    The call is found in the traceback, because a wrapper around every function would slow every call down.
    """
    if not isinstance(error, _MISTAKES):
        return None
    if (line := getattr(error, "explained", None)) is not None:  # the message from the simulation's process
        return str(line)
    functions = [
        (f"{contents(api)[0]}.{name}", function) for api in apis for name, function in contents(api)[1].items()
    ]
    by_code = {function.__code__: (name, function) for name, function in reversed(functions)}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        if frame.f_code in by_code:
            name, function = by_code[frame.f_code]
            parameters = inspect.signature(function).parameters.values()
            arguments = [frame.f_locals[each.name] for each in parameters if each.kind is not each.VAR_POSITIONAL]
            return explain(name, function, arguments, error)
    for name, function in functions:
        if str(error).startswith(f"{function.__qualname__}() "):  # raised by the call itself
            return f"{name}: wrong number of values, expected ({_expected(inspect.signature(function))})"
    return None


def explain(name: str, function: Function, arguments: Sequence[Any], error: Exception) -> str:
    """Return a one-line message: what is wrong, the arguments, the expected ones."""
    if isinstance(error, ValueError):
        return f"{name}: {str(error)[:_LONGEST]}"
    signature = inspect.signature(function)
    try:
        signature.bind(*arguments)
        reason = str(error) if isinstance(error, WrongValue) else "wrong kind of value"
    except TypeError:
        reason = "wrong number of values"
    shown = ", ".join(show(value) for value in arguments[:_MOST])
    return f"{name}: {reason}: got ({shown}), expected ({_expected(signature)})"


def most_values(function: Function) -> int:
    """Return the largest number of arguments of a function."""
    kinds = [parameter.kind for parameter in inspect.signature(function).parameters.values()]
    return sys.maxsize if inspect.Parameter.VAR_POSITIONAL in kinds else len(kinds)


def _expected(signature: inspect.Signature) -> str:
    """Return the parameters as text: 'handle: Handle, relativeTo: Handle = -1'."""
    shown = []
    for parameter in signature.parameters.values():
        text = f"{parameter.name}: {parameter.annotation}"
        if parameter.kind is parameter.VAR_POSITIONAL:
            continue
        shown.append(text if parameter.default in (parameter.empty, ()) else f"{text} = {show(parameter.default)}")
    return ", ".join(shown)


def show(value: Any, depth: int = 0) -> str:
    """Return any value as short text on one line, for messages."""
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
