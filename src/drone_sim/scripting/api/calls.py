"""The functions of the script API: how one is declared, and how calls reach it.

A function is declared where it is written, once for Lua, Python, the remote API and docs/api.md, by what its module is
called and by which generations of V-REP have it under which names:

    @sim("5", getInt32Parameter="34")
    def getInt32Param(self, parameter: int) -> int:
        ...

Error messages name the expected arguments by their annotations; docs/api.md shows the docstring, in a section for each
class.
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
}  # what names of 3.x begin with
_MISTAKES = (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError)
_SHOWN = 60  # characters of a value
_MOST = 13  # values
_LONGEST = 1000  # characters of an error's message


@dataclass(frozen=True)
class Declaration:
    """What a function is in the API.

    names: what scripts call it, its own name first, and for each the generations of V-REP that have it: 3 for 3.x, 4
    for 4.0 to 4.2, 5 for 4.3 and later, such as "45"; '' if only drone_sim has it.
    """

    module: str
    names: Mapping[str, str]


class Module:
    """Declares the functions of one module of the API, which hold a Declaration from then on."""

    def __init__(self, name: str):
        """`name`: what scripts call it."""
        self._name = name

    def __call__(self, generations: str = "345", **others: str) -> Callable[[_Method], _Method]:
        """Declare a function by the generations that have it under its own name, and under which others."""

        def declare(function: _Method) -> _Method:
            names = {function.__name__: generations, **others}
            function.declaration = Declaration(self._name, names)  # type: ignore[attr-defined]
            return function

        return declare

    def add(self, to: type, function: Function, name: str, doc: str, generations: str = "345", **others: str) -> None:
        """Declare a function that was made, not written, as a method of a class: its name, docstring, and names."""
        function.__name__, function.__qualname__, function.__doc__ = name, f"{to.__name__}.{name}", doc
        setattr(to, name, self(generations, **others)(function))


sim, simROS = Module("sim"), Module("simROS")


def declaration_of(function: Function) -> Declaration | None:
    """Return how a function was declared, None where it was not."""
    return getattr(function, "declaration", None)


def methods_of(kind: type) -> Iterator[tuple[Function, str, list[str]]]:
    """Yield the declared methods of a class, each with its own name and all names of its function, as module.name."""
    for method in vars(kind).values():
        declaration = declaration_of(method)
        if declaration is not None:
            module = declaration.module
            yield method, f"{module}.{method.__name__}", [f"{module}.{name}" for name in declaration.names]


def functions_of(*parts: object) -> dict[str, Function]:
    """Return the functions that were declared in the classes of some objects, under each of their names."""
    found: dict[str, Function] = {}
    for part in parts:
        for attribute, names in _declared_in(type(part)):  # type: ignore[arg-type] # a class has a hash
            found.update(dict.fromkeys(names, getattr(part, attribute)))
    return found


@functools.cache
def _declared_in(kind: type) -> list[tuple[str, Mapping[str, str]]]:
    """Return the methods of a class that were declared, each with the names that it has in the API."""
    declared = ((attribute, declaration_of(getattr(kind, attribute))) for attribute in dir(kind))
    return [(attribute, declaration.names) for attribute, declaration in declared if declaration is not None]


def flat_name(module: str, name: str) -> str:
    """Return what a function of a module is called in 3.x: simGetObjectPosition, simExtRosInterface_publish."""
    return _FLAT.get(module, f"{module}_") + (f"{name[:1].upper()}{name[1:]}" if module == "sim" else name)


class UnknownName(AttributeError):
    """A script asked for a function or constant that the API does not have."""


class Api:
    """The functions and constants of one module, such as `sim`, as the attributes that a Python script uses."""

    def __init__(
        self,
        name: str,
        functions: Mapping[str, Function],
        constants: Mapping[str, Any],
        save_state: Callable[[], Callable[[], None]] | None = None,
    ):
        """`name`: what scripts call it; `functions` and `constants`: what it has.

        `save_state` returns a function that restores the values which a script has set, and which are stored only here.
        """
        self.__dict__.update(constants)
        self.__dict__.update(functions)
        # Kept out of sight: whatever else is an attribute is the script's to use.
        self.__dict__["_api"] = (name, dict(functions), dict(constants), save_state)

    def __getattr__(self, name: str) -> Any:
        """Raise UnknownName, with the near names; called for what is not there."""
        own, functions, constants, _ = self.__dict__["_api"]
        raise UnknownName(not_there(f"{own}.", name, [*functions, *constants]))


def contents(api: Api) -> tuple[str, dict[str, Function], dict[str, Any]]:
    """Return name, functions and constants of an API."""
    name, functions, constants, _ = api.__dict__["_api"]
    return name, functions, constants


def save_state(apis: Iterable[Api]) -> list[Callable[[], None]]:
    """Return functions that bring back what a script has set in its APIs."""
    saving = (api.__dict__["_api"][3] for api in apis)
    return [one() for one in saving if one is not None]


def mistake(error: BaseException, apis: Iterable[Api]) -> str | None:
    """Return one line on an error that a call of an API raised in a Python script; None for any other error.

    Looked up afterwards, in the traceback: a guard around every function would cost every call.
    """
    if not isinstance(error, _MISTAKES):
        return None
    if (line := getattr(error, "explained", None)) is not None:  # where the function was called, in another process
        return str(line)
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


def most_values(function: Function) -> int:
    """Return how many values a function takes at most."""
    kinds = [one.kind for one in inspect.signature(function).parameters.values()]
    return sys.maxsize if inspect.Parameter.VAR_POSITIONAL in kinds else len(kinds)


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
