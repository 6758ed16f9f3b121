"""What brings an object back to where it was: functions that may be called again and again."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable
from typing import Any

Restore = Callable[[], None]
_CONTAINERS = (list, dict, set, deque)


def saved(owner: object, *names: str) -> Restore:
    """Return a function that gives some attributes of an object the values back that they have now.

    Lists, dicts, sets and deques are copied, but not what is in them: all else is replaced, and never changed.
    """
    kept = {name: _copied(getattr(owner, name)) for name in names}

    def restore() -> None:
        for name, value in kept.items():
            setattr(owner, name, _copied(value))

    return restore


def in_turn(*parts: Restore) -> Restore:
    """Return a function that calls several, in this order."""

    def restore() -> None:
        for one in parts:
            one()

    return restore


def _copied(value: Any) -> Any:
    return copy.copy(value) if isinstance(value, _CONTAINERS) else value
