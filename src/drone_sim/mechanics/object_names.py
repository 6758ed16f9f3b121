"""Object names with V-REP's suffix: the copies of a model's `base` are `base`, `base#0`, `base#1`, ..."""

from __future__ import annotations

import itertools
import re
from collections.abc import Container, Iterable, Iterator, Sequence

NO_SUFFIX = -1  # suffix of a name without one
_SUFFIXED = re.compile(r"(.+)#(\d+)", re.DOTALL)


def suffixed(name: str, suffix: int) -> str:
    """Return a name with a suffix, or unchanged for NO_SUFFIX."""
    return name if suffix == NO_SUFFIX else f"{name}#{suffix}"


def split(name: str) -> tuple[str, int]:
    """Return a name without its suffix, and the suffix (NO_SUFFIX if there is none)."""
    match = _SUFFIXED.fullmatch(name)
    return (match.group(1), int(match.group(2))) if match else (name, NO_SUFFIX)


def shifted(names: Sequence[str], taken: Container[str]) -> list[str]:
    """Return the names of a model's copy as V-REP does: all suffixes raised until no name is `taken`."""
    copies = ([suffixed(bare, suffix + shift) for bare, suffix in map(split, names)] for shift in itertools.count())
    return next(copy for copy in copies if not any(name in taken for name in copy))


def numbered(name: str) -> Iterator[str]:
    """Return an iterator over a name without and with numbers: Cuboid, Cuboid0, Cuboid1, ..."""
    return itertools.chain([name], (f"{name}{number}" for number in itertools.count()))


def suffixes() -> Iterator[str]:
    """Return an iterator over the suffixes of a model's copies: '', #0, #1, ..."""
    return itertools.chain([""], map("#{}".format, itertools.count()))


def first_free(names: Iterable[str], *taken: Container[str]) -> str:
    """Return the first of `names` that is in none of the containers."""
    return next(name for name in names if not any(name in container for container in taken))


def plain(name: str) -> str:
    """Return a name without its suffix."""
    return split(name)[0]
