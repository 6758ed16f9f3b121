"""How much a script may hand over at once, and how it is counted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

DEEPEST = 16  # levels of nested tables, lists and mappings
MOST_VALUES = 3 * 2048 * 2048  # in one call or message: the largest picture of a vision sensor, as numbers
MOST_BYTES = 64 * 1024 * 1024  # of all its strings

_PLAIN = frozenset((float, int, bool, type(None)))
_STRINGS = (str, bytes, bytearray, memoryview)
Fields = Callable[[Any], Mapping[Any, Any] | None]


def refuse_if_too_large(
    value: Any, fields: Fields = lambda value: value if isinstance(value, Mapping) else None
) -> None:
    """Raise ValueError for a value of the script's that is nested too deeply, in itself, or that is too large.

    `fields` returns the named fields of what has some. Lists, tuples and mappings are looked into, and what has fields.
    """
    if type(value) in _PLAIN:
        return
    count = size = 0
    waiting: list[tuple[Any, int]] = [(value, 0)]
    while waiting:
        value, depth = waiting.pop()
        if isinstance(value, _STRINGS):
            size += len(value)
            if size > MOST_BYTES:
                raise ValueError(f"more than {MOST_BYTES} bytes cannot be passed")
            continue
        inner = _inner(value, fields)
        if inner is None:
            continue
        if depth >= DEEPEST:
            raise ValueError(f"a table is nested too deeply: at most {DEEPEST} levels are allowed")
        count += len(inner)
        if count > MOST_VALUES:
            raise ValueError(f"more than {MOST_VALUES} values are too many")
        waiting.extend((one, depth + 1) for one in _not_plain(inner))


def _not_plain(values: list[Any]) -> list[Any]:
    """Return those that are to be looked into; whether there are any is asked at once, for images have millions."""
    return [] if _PLAIN.issuperset(map(type, values)) else [one for one in values if type(one) not in _PLAIN]


def _inner(value: Any, fields: Fields) -> list[Any] | None:
    named = fields(value)
    if named is not None:
        return [*named.keys(), *named.values()]
    if not hasattr(value, "__len__") or not hasattr(value, "__iter__"):
        return None
    if len(value) > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES} values are too many")
    return list(value)
