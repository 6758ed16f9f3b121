"""The variables of a Python script, as a person reads them. None of the script's own code is called for it.

So no method of a script's class is called, neither `__repr__` nor a property: of a value that needs them, only the type
is shown. The size of the result is always limited.
"""

from __future__ import annotations

import itertools
import sys
from collections import deque
from collections.abc import Iterator, Mapping
from types import BuiltinFunctionType, FrameType, FunctionType, GetSetDescriptorType, MethodType, ModuleType
from typing import Any

from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.breakpoints import LONGEST_NAME, LONGEST_VALUE, MOST_INSIDE, MOST_ROWS, Row, Scope

_FEW = 13  # values that are shown in a line
_LONG = 256  # bits of a number that is shown
_LISTS: tuple[Any, ...] = (list, tuple, deque)
_SETS: tuple[Any, ...] = (set, frozenset)
_UNINTERESTING = (ModuleType, FunctionType, BuiltinFunctionType, MethodType, type, Api)
# What these are of a class, whatever its metaclass says.
_name_of, _classes_of = type.__dict__["__name__"].__get__, type.__dict__["__mro__"].__get__
_names_in = type.__dict__["__dict__"].__get__


def variables(script: Mapping[str, Any]) -> list[Scope]:
    """Return `self` and the global variables of a script, by its global names."""
    own = self_of(script)
    return [Scope("self", _rows(_attributes(own) or {})), Scope("globals", _globals(script))]


def variables_at(frame: FrameType) -> list[Scope]:
    """Return what a line of a script sees: its local variables, `self` and the global ones."""
    there = variables(frame.f_globals)
    if frame.f_locals is frame.f_globals:
        return there
    return [Scope("locals", _rows(frame.f_locals)), *there]


def self_of(script: Mapping[str, Any]) -> Any:
    """Return the script's `self`: a global of its own, or what is found as `len` is."""
    found = script.get("__builtins__")
    return script.get("self", found.get("self") if type(found) is dict else None)


def _globals(script: Mapping[str, Any]) -> list[Row]:
    return _rows({name: one for name, one in script.items() if name != "self"})


def _rows(values: Mapping[Any, Any]) -> list[Row]:
    """Return the rows of variables, without functions, classes and modules."""
    own = ((name, one) for name, one in values.items() if type(name) is str and name[:2] != "__")
    shown = ((name, one) for name, one in own if not issubclass(type(one), _UNINTERESTING))
    return [_row(name, one, _inside(one)) for name, one in itertools.islice(shown, MOST_ROWS)]


def _row(name: str, value: Any, inside: tuple[Row, ...] = ()) -> Row:
    return Row(name[:LONGEST_NAME], _type_name(value), shown(value), inside)


def _type_name(value: Any) -> str:
    return str(_name_of(type(value)))[:LONGEST_NAME]


def _inside(value: Any) -> tuple[Row, ...]:
    """Return what is within a value, one level deep."""
    items = itertools.islice(_items(value), MOST_INSIDE)
    return tuple(_row(name, one) for name, one in items)


def _items(value: Any) -> Iterator[tuple[str, Any]]:
    kind = type(value)
    if issubclass(kind, dict):
        return ((_key(key), one) for key, one in dict.items(value))
    of = _base(kind, (*_LISTS, *_SETS))
    if of is not None:
        if _is_short(value, of):
            return iter(())
        return ((f"[{index}]", one) for index, one in enumerate(of.__iter__(value)))
    if _is_array(value):
        return iter(())
    return ((str(name), one) for name, one in (_attributes(value) or {}).items() if type(name) is str)


def _base(kind: type, among: tuple[Any, ...]) -> Any:
    return next((one for one in among if issubclass(kind, one)), None)


def _is_short(value: Any, of: Any) -> bool:
    """Tell whether all of a list is in its own row: a vector."""
    return bool(of.__len__(value) <= _FEW and all(type(one) in (int, float, bool) for one in of.__iter__(value)))


def _attributes(value: Any) -> dict[Any, Any] | None:
    """Return the attributes of an object of a script's class; None for any other."""
    own = [_names_in(kind)["__dict__"] for kind in _classes_of(type(value)) if "__dict__" in _names_in(kind)]
    if not own or any(type(one) is not GetSetDescriptorType for one in own):
        return None
    try:
        found = own[0].__get__(value)
    except (AttributeError, TypeError):
        return None
    return found if type(found) is dict else None


def shown(value: Any, digits: str = ".6g") -> str:
    """Return a value on one line, in at most LONGEST_VALUE characters."""
    text = _shown(value, digits)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


def _shown(value: Any, digits: str) -> str:
    kind = type(value)
    if value is None or kind is bool:
        return str(value)
    if issubclass(kind, float):
        return format(float.__float__(value), digits)
    if issubclass(kind, int):
        bits = int.bit_length(value)
        return int.__repr__(value) if bits <= _LONG else f"a number of {bits} bits"
    if issubclass(kind, (str, bytes, bytearray)):
        return _of_text(value, kind)
    if kind is complex:
        return repr(value)
    return _of_several(value, kind)


def _of_text(value: Any, kind: type) -> str:
    base = next(one for one in (str, bytes, bytearray) if issubclass(kind, one))
    return str(repr(base.__getitem__(value, slice(0, LONGEST_VALUE))))


def _of_several(value: Any, kind: type) -> str:
    """Return a list with its first values, and of all others how many there are."""
    of = _base(kind, _LISTS)
    if of is not None:
        return _listed(of.__len__(value), of.__iter__(value), "()" if of is tuple else "[]")
    if _is_array(value):
        return _of_array(value)
    if issubclass(kind, dict):
        return _counted(dict.__len__(value), "entries", "entry")
    of = _base(kind, _SETS)
    return _counted(of.__len__(value), "values", "value") if of is not None else ""


def _listed(count: int, values: Iterator[Any], ends: str) -> str:
    some = list(itertools.islice(values, _FEW))
    if not all(type(one) in (int, float, bool, str) or one is None for one in some):
        return _counted(count, "values", "value")
    more = f", … {count} values" if count > _FEW else ""
    return f"{ends[0]}{', '.join(_shown(one, '.3f') for one in some)}{more}{ends[1]}"


def _counted(count: int, several: str, one: str) -> str:
    return f"{count} {one if count == 1 else several}"


# ---- numpy, which a script may have imported


def _is_array(value: Any) -> bool:
    numpy = sys.modules.get("numpy")
    return numpy is not None and issubclass(type(value), (numpy.ndarray, numpy.generic))


def _of_array(value: Any) -> str:
    import numpy as np

    plain = np.ndarray.view(value, np.ndarray) if isinstance(value, np.ndarray) else np.asarray(value)
    if plain.dtype.kind not in "biufc":
        return f"{plain.dtype} {plain.shape}"
    if not plain.shape:
        return _shown(plain.item(), ".6g")
    text = _listed(plain.size, iter(plain.flat[:_FEW].tolist()), "[]")
    return text if plain.ndim == 1 else f"{' x '.join(map(str, plain.shape))}: {text}"


def _key(key: Any) -> str:
    return shown(key) or _type_name(key)
