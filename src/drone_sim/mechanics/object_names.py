"""Names of objects with V-REP's suffix: the copies of a model's `base` are `base`, `base#0`, `base#1`, ..."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

NO_SUFFIX = -1  # what has no suffix
_SUFFIXED = re.compile(r"(.+)#(\d+)", re.DOTALL)


def suffixed(name: str, suffix: int) -> str:
    """Return a name with a suffix, as it is for NO_SUFFIX."""
    return name if suffix == NO_SUFFIX else f"{name}#{suffix}"


def split(name: str) -> tuple[str, int]:
    """Return a name without its suffix, and the suffix; NO_SUFFIX where it has none."""
    match = _SUFFIXED.fullmatch(name)
    return (match.group(1), int(match.group(2))) if match else (name, NO_SUFFIX)


def numbered(name: str) -> Iterator[str]:
    """Return a name, and then with numbers: Cuboid, Cuboid0, Cuboid1, ..."""
    return itertools.chain([name], (f"{name}{number}" for number in itertools.count()))


def plain(name: str) -> str:
    """Return a name without its suffix."""
    return split(name)[0]
