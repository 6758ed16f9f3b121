"""Files are written whole or not at all: what was there before stays until the new one is safe on the disk."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any


@contextlib.contextmanager
def replacing(path: str | Path, binary: bool = False, through_links: bool = True) -> Iterator[IO[Any]]:
    """Give a file to write, which takes the place of `path` at the end; on an OSError the old one stays.

    It is a temporary file in the same folder until then. Another exception (a flight that fails) keeps what was
    written up to there. A `path` that is not a regular file, such as /dev/stdout or a FIFO, is written directly. Text
    is UTF-8 with \\n. Where not `through_links`, a link or a FIFO of that name is replaced itself, and nothing behind
    it is touched. Raises OSError, in one line that names the file.
    """
    options: Any = {"mode": "xb"} if binary else {"mode": "x", "encoding": "utf-8", "newline": "\n"}
    with naming(path):
        check(path)
        if through_links and _is_special(path):
            with open(path, **{**options, "mode": options["mode"].replace("x", "w")}) as file:
                yield file
            return
        folder, name = os.path.split(os.path.realpath(path) if through_links else os.path.abspath(path))
        target = os.path.join(folder, name)
        stem, ending = os.path.splitext(name)  # libraries that write by name look at the ending
        temporary = os.path.join(folder, f".{stem:.100}.{secrets.token_hex(4)}{ending:.20}")
        try:
            with open(temporary, **options) as file:
                try:
                    yield file
                except OSError:
                    raise
                except BaseException:
                    _finish(file, temporary, target)
                    raise
                _finish(file, temporary, target)
        except OSError:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
            raise


def write(path: str | Path, content: str, through_links: bool = True) -> None:
    """Write a text file whole or not at all, as `replacing`. Raises OSError, in one line that names the file."""
    with replacing(path, through_links=through_links) as file:
        file.write(content)


def write_new(path: str | Path, content: str | bytes) -> None:
    """Write a file, text in UTF-8, where nothing is of that name, no link either. Raises FileExistsError, OSError."""
    with naming(path), open(path, "xb") as file:  # which follows no link
        try:
            file.write(content.encode("utf-8") if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            os.unlink(path)
            raise


def check(path: str | Path) -> None:
    """Raise OSError, in one line, where `path` cannot become a file."""
    with naming(path):
        if os.path.isdir(path):
            raise IsADirectoryError(0, "is a folder")
        folder = os.path.dirname(os.path.realpath(path))
        if not _is_special(path) and not os.path.isdir(folder):
            raise FileNotFoundError(0, f"no such folder: {folder}")
        if os.path.exists(path) and not os.access(path, os.W_OK):
            raise PermissionError(0, "must not be written to")


def _is_special(path: str | Path) -> bool:
    # /dev/stdout may lead to a regular file, to which somebody else writes, too.
    named = os.path.abspath(path).startswith(("/dev/", "/proc/"))
    return named or (os.path.exists(path) and not os.path.isfile(path))


def _finish(file: IO[Any], temporary: str, target: str) -> None:
    file.flush()
    if os.path.exists(target):
        shutil.copymode(target, temporary)
    os.fsync(file.fileno())
    os.replace(temporary, target)
    folder = os.open(os.path.dirname(target), os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@contextlib.contextmanager
def naming(path: str | Path) -> Iterator[None]:
    """Let an OSError be one line that names the file; so is a ValueError for a name with a NUL in it."""
    try:
        yield
    except OSError as error:
        if str(path) in str(error):
            raise
        raise OSError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        if "null byte" not in str(error):
            raise
        raise OSError(f"{path!r:.60}: {error}") from None
