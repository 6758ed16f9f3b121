"""A script's file: read and written whole, as text, with the line ends that it has."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from drone_sim.files import writing
from drone_sim.files.resources import read_bytes

LARGEST = 1 << 20  # bytes
_LARGEST_COPY = 1 << 26  # bytes of what another program has made of a script
_NO_VERSION = ""


class ShelfError(ValueError):
    """What was asked of the shelf cannot be done; one line."""


def read(name: str, path: Path) -> tuple[str, str]:
    r"""Return the text in a file, its lines ended by \n, and its version. Raises ShelfError, which says `name`."""
    version = version_of(path)
    content = _bytes(name, path)
    try:
        return content.decode("utf-8").replace("\r\n", "\n"), version
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ShelfError(f"{name}: line {line}: is not UTF-8, and cannot be edited here") from None


def write(name: str, path: Path, text: str, is_new: bool = False) -> str:
    r"""Write a file, with lines ended by \r\n where most were, and return its version.

    No link is followed: neither one that `path` is, nor one that it becomes meanwhile. What `is_new` takes the place
    of nothing. Raises ShelfError.
    """
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        raise ShelfError(f"{name}: line {line}: holds half of a character, which no file can hold") from None
    if len(content) > LARGEST:
        raise ShelfError(f"{name}: has {len(content)} bytes; at most {LARGEST} are kept")
    if not is_new and _has_windows_line_ends(path):
        text = text.replace("\n", "\r\n")
    with _told_of(name):
        path.parent.mkdir(parents=True, exist_ok=True)
        writing.write_new(path, text) if is_new else writing.write(path, text, through_links=False)
    return version_of(path)


def copy(name: str, path: Path, to: Path) -> None:
    """Copy a file, whatever it holds, to where nothing is. Raises ShelfError."""
    with _told_of(name):
        writing.write_new(to, read_bytes(path, _LARGEST_COPY))


def version_of(path: Path) -> str:
    """Return what changes whenever the file does, '' where it is not there."""
    try:
        state = path.stat()
    except (OSError, ValueError):
        return _NO_VERSION
    return f"{state.st_mtime_ns}-{state.st_size}-{state.st_ino}"


def _bytes(name: str, path: Path) -> bytes:
    with _told_of(name):
        return read_bytes(path, LARGEST)


def _has_windows_line_ends(path: Path) -> bool:
    try:
        content = read_bytes(path, LARGEST)
    except (OSError, ValueError):
        return False
    return 2 * content.count(b"\r\n") > content.count(b"\n")


@contextlib.contextmanager
def _told_of(name: str) -> Iterator[None]:
    """Let what goes wrong with a file be told in one line: errno's words with the file, or our own."""
    try:
        yield
    except OSError as error:
        said = f"{error.filename}: {os.strerror(error.errno)}" if error.errno and error.filename else str(error)
        raise ShelfError(f"{name}: {said}") from None
    except ValueError as error:
        raise ShelfError(f"{name}: {error}") from None
