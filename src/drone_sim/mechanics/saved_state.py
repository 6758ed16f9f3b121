"""Functions that restore the saved state of an object; each may be called any number of times."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable
from typing import Any

Restore = Callable[[], None]
_CONTAINERS = (list, dict, set, deque)


def saved(owner: object, *names: str, deep: bool = False) -> Restore:
    """Return a function that gives the attributes `names` of `owner` the values back that they have now.

    Lists, dicts, sets and deques are copied, but not their items. Other values must be replaced, not changed in place.
    `deep`: everything is copied.
    """
    copied = copy.deepcopy if deep else _copy_of_container
    values = {name: copied(getattr(owner, name)) for name in names}

    def restore() -> None:
        for name, value in values.items():
            setattr(owner, name, copied(value))

    return restore


def in_turn(*parts: Restore) -> Restore:
    """Return a function that calls all `parts`, in this order."""

    def restore() -> None:
        for part in parts:
            part()

    return restore


def _copy_of_container(value: Any) -> Any:
    return copy.copy(value) if isinstance(value, _CONTAINERS) else value
