"""Breakpoints of Python scripts, and variables in readable form, without calling any code of the script.

No method of a script's class is called, neither `__repr__` nor a property. Only the type is shown of a value that would
need them. The size of the result is always limited.
"""

from __future__ import annotations

import itertools
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from types import BuiltinFunctionType, FrameType, FunctionType, GetSetDescriptorType, MethodType, ModuleType
from typing import Any

from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.breakpoints import LONGEST_NAME, LONGEST_VALUE, MOST_INSIDE, MOST_ROWS, Breakpoints, Row, Scope

_FEW = 13  # values shown in a line
_LONG = 256  # bits of the largest number that is shown
_LISTS: tuple[Any, ...] = (list, tuple, deque)
_SETS: tuple[Any, ...] = (set, frozenset)
_UNINTERESTING = (ModuleType, FunctionType, BuiltinFunctionType, MethodType, type, Api)
# Attributes of a class itself, whatever its metaclass returns for them.
_name_of, _classes_of = type.__dict__["__name__"].__get__, type.__dict__["__mro__"].__get__
_names_in = type.__dict__["__dict__"].__get__
_set_trace, _get_trace = sys.settrace, sys.gettrace  # before process.py replaces them


class LineTracer:
    """Detects reached breakpoints, by a trace function that Python calls for each line."""

    def __init__(self, breakpoints: Breakpoints):
        self._breakpoints = breakpoints

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function, and trace it with all functions that it calls. Raises its exceptions."""
        before = _get_trace()
        _set_trace(self._on_call)
        try:
            return function(*arguments)
        finally:
            _set_trace(before)

    def resume(self) -> None:
        """Trace a thread that starts or resumes; to be called in its greenlet."""
        _set_trace(None)  # since 3.13, only frames that run when tracing is switched on are traced
        _set_trace(self._on_call)
        frame: FrameType | None = sys._getframe()
        while frame is not None:
            if self._breakpoints.lines(frame.f_code.co_filename):
                frame.f_trace = self._on_line
            frame = frame.f_back

    def _on_call(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        return self._on_line if self._breakpoints.lines(frame.f_code.co_filename) else None

    def _on_line(self, frame: FrameType, event: str, _argument: Any) -> Any:
        file = frame.f_code.co_filename
        if event == "line" and frame.f_lineno in self._breakpoints.lines(file):
            self._breakpoints.reach(file, frame.f_lineno, lambda: variables_at(frame))
        return self._on_line


def variables(script: Mapping[str, Any]) -> list[Scope]:
    """Return `self` and the global variables of a script; `script` are its globals."""
    own = self_of(script)
    global_variables = {name: value for name, value in script.items() if name != "self"}
    return [Scope("self", _rows(_attributes(own) or {})), Scope("globals", _rows(global_variables))]


def variables_at(frame: FrameType) -> list[Scope]:
    """Return the variables that a line of a script can access: locals, `self` and globals."""
    scopes = variables(frame.f_globals)
    if frame.f_locals is frame.f_globals:
        return scopes
    return [Scope("locals", _rows(frame.f_locals)), *scopes]


def self_of(script: Mapping[str, Any]) -> Any:
    """Return the script's `self`: its global variable, or else the one in its builtins."""
    builtins = script.get("__builtins__")
    return script.get("self", builtins.get("self") if type(builtins) is dict else None)


def _rows(values: Mapping[Any, Any]) -> list[Row]:
    """Return the rows of variables, without functions, classes and modules."""
    own = ((name, value) for name, value in values.items() if type(name) is str and name[:2] != "__")
    shown = ((name, value) for name, value in own if not issubclass(type(value), _UNINTERESTING))
    return [
        _row(name, value, tuple(_row(*item) for item in itertools.islice(_items(value), MOST_INSIDE)))
        for name, value in itertools.islice(shown, MOST_ROWS)
    ]


def _row(name: str, value: Any, inside: tuple[Row, ...] = ()) -> Row:
    return Row(name[:LONGEST_NAME], _type_name(value), shown(value), inside)


def _type_name(value: Any) -> str:
    return str(_name_of(type(value)))[:LONGEST_NAME]


def _items(value: Any) -> Iterator[tuple[str, Any]]:
    """Return the values inside a value, one level deep."""
    kind = type(value)
    if issubclass(kind, dict):
        return ((shown(key) or _type_name(key), item) for key, item in dict.items(value))
    base = _base(kind, (*_LISTS, *_SETS))
    if base is not None:
        if _is_vector(value, base):
            return iter(())
        return ((f"[{index}]", item) for index, item in enumerate(base.__iter__(value)))
    if _is_array(value):
        return iter(())
    return ((str(name), item) for name, item in (_attributes(value) or {}).items() if type(name) is str)


def _base(kind: type, candidates: tuple[Any, ...]) -> Any:
    return next((base for base in candidates if issubclass(kind, base)), None)


def _is_vector(value: Any, base: Any) -> bool:
    """Return whether a list is short enough to be shown completely in its own row."""
    return bool(base.__len__(value) <= _FEW and all(type(item) in (int, float, bool) for item in base.__iter__(value)))


def _attributes(value: Any) -> dict[Any, Any] | None:
    """Return the attributes of an instance of a script's class; None for any other object."""
    own = [_names_in(kind)["__dict__"] for kind in _classes_of(type(value)) if "__dict__" in _names_in(kind)]
    if not own or any(type(descriptor) is not GetSetDescriptorType for descriptor in own):
        return None
    try:
        attributes = own[0].__get__(value)
    except (AttributeError, TypeError):
        return None
    return attributes if type(attributes) is dict else None


def shown(value: Any, digits: str = ".6g") -> str:
    """Return a value on one line, in at most LONGEST_VALUE characters."""
    text = _show(value, digits)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


def _show(value: Any, digits: str) -> str:
    kind = type(value)
    if value is None or kind is bool:
        return str(value)
    if issubclass(kind, float):
        return format(float.__float__(value), digits)
    if issubclass(kind, int):
        bits = int.bit_length(value)
        return int.__repr__(value) if bits <= _LONG else f"a number of {bits} bits"
    if issubclass(kind, (str, bytes, bytearray)):
        base = _base(kind, (str, bytes, bytearray))
        return str(repr(base.__getitem__(value, slice(0, LONGEST_VALUE))))
    if kind is complex:
        return repr(value)
    return _show_collection(value, kind)


def _show_collection(value: Any, kind: type) -> str:
    """Return the first values of a list or array; for other collections, the number of values."""
    base = _base(kind, _LISTS)
    if base is not None:
        return _show_items(base.__len__(value), base.__iter__(value), "()" if base is tuple else "[]")
    if _is_array(value):
        return _show_array(value)
    if issubclass(kind, dict):
        return _counted(dict.__len__(value), "entries", "entry")
    base = _base(kind, _SETS)
    return _counted(base.__len__(value), "values", "value") if base is not None else ""


def _show_items(count: int, values: Iterator[Any], brackets: str) -> str:
    some = list(itertools.islice(values, _FEW))
    if not all(type(item) in (int, float, bool, str) or item is None for item in some):
        return _counted(count, "values", "value")
    more = f", … {count} values" if count > _FEW else ""
    return f"{brackets[0]}{', '.join(_show(item, '.3f') for item in some)}{more}{brackets[1]}"


def _counted(count: int, plural: str, singular: str) -> str:
    return f"{count} {singular if count == 1 else plural}"


# ---- numpy, which a script may have imported


def _is_array(value: Any) -> bool:
    numpy = sys.modules.get("numpy")
    return numpy is not None and issubclass(type(value), (numpy.ndarray, numpy.generic))


def _show_array(value: Any) -> str:
    import numpy as np

    plain = np.ndarray.view(value, np.ndarray) if isinstance(value, np.ndarray) else np.asarray(value)
    if plain.dtype.kind not in "biufc":
        return f"{plain.dtype} {plain.shape}"
    if not plain.shape:
        return _show(plain.item(), ".6g")
    text = _show_items(plain.size, iter(plain.flat[:_FEW].tolist()), "[]")
    return text if plain.ndim == 1 else f"{' x '.join(map(str, plain.shape))}: {text}"
