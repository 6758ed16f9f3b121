"""What was read from files, kept while they stay as they are."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Iterable
from typing import Any, Generic, NamedTuple, TypeVar

T = TypeVar("T")
Identity = tuple[int, int, int] | None  # modification time (ns), size (bytes), inode


class Reading(NamedTuple):
    """What a file held, how much memory it takes (bytes), and what other files it depends on."""

    value: Any
    size: int
    files: Iterable[str] = ()


class FileCache(Generic[T]):
    """Reads files by path; the ones used last stay, up to `limit` bytes."""

    def __init__(self, read: Callable[[str], Reading], limit: int):
        """Take what reads a file."""
        self._read = read
        self._limit = limit
        self._kept: OrderedDict[str, tuple[Reading, dict[str, Identity]]] = OrderedDict()

    def get(self, path: str) -> T:
        """Return what is in a file now. Raises what `read` raises."""
        kept = self._kept.get(path)
        if kept is None or any(identity_of(file) != identity for file, identity in kept[1].items()):
            before = identity_of(path)
            reading = self._read(path)
            kept = (reading, {path: before, **{file: identity_of(file) for file in reading.files}})
            self._kept[path] = kept
        self._kept.move_to_end(path)
        while len(self._kept) > 1 and sum(one.size for one, _ in self._kept.values()) > self._limit:
            self._kept.popitem(last=False)
        value: T = kept[0].value
        return value


def identity_of(path: str) -> Identity:
    """Return what changes when a file is written anew; None where there is no such file."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
