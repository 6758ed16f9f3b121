"""Atomic writing of files: an old file stays until the new one is complete and on the disk."""

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
    """Yield a temporary file in the folder of `path`, and replace `path` by it at the end.

    After an OSError the old file stays. After another exception, such as that of a failed flight, the new file has
    what was written before it. A `path` that is not a regular file, such as /dev/stdout or a FIFO, is written directly.
    Text is UTF-8 with \\n. If not `through_links`, a link or FIFO at `path` is itself replaced, not written through.
    Raises OSError, in one line with the file's name.
    """
    options: Any = {"mode": "xb"} if binary else {"mode": "x", "encoding": "utf-8", "newline": "\n"}
    with name_in_errors(path):
        check_writable(path)
        if through_links and _is_special(path):
            with open(path, **{**options, "mode": options["mode"].replace("x", "w")}) as file:
                yield file
            return
        folder, name = os.path.split(os.path.realpath(path) if through_links else os.path.abspath(path))
        target = os.path.join(folder, name)
        stem, ending = os.path.splitext(name)  # some libraries choose the format by the ending
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
    """Write a text file with `replacing`. Raises OSError, in one line with the file's name."""
    with replacing(path, through_links=through_links) as file:
        file.write(content)


def write_new(path: str | Path, content: str | bytes) -> None:
    """Write a file (text in UTF-8) at a path where there is neither a file nor a link.

    Raises FileExistsError, and OSError.
    """
    with name_in_errors(path), open(path, "xb") as file:  # the mode "x" follows no link
        try:
            file.write(content.encode("utf-8") if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            os.unlink(path)
            raise


def check_writable(path: str | Path) -> None:
    """Raise OSError, in one line, if no file can be written at `path`."""
    with name_in_errors(path):
        if os.path.isdir(path):
            raise IsADirectoryError(0, "is a folder")
        folder = os.path.dirname(os.path.realpath(path))
        if not _is_special(path) and not os.path.isdir(folder):
            raise FileNotFoundError(0, f"no such folder: {folder}")
        if os.path.exists(path) and not os.access(path, os.W_OK):
            raise PermissionError(0, "must not be written to")


def _is_special(path: str | Path) -> bool:
    # /dev/stdout may be a link to a regular file, which other programs write to, too.
    is_system = os.path.abspath(path).startswith(("/dev/", "/proc/"))
    return is_system or (os.path.exists(path) and not os.path.isfile(path))


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
def name_in_errors(path: str | Path) -> Iterator[None]:
    """Turn an OSError, or the ValueError for a NUL in a path, into an OSError in one line with the file's name."""
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
