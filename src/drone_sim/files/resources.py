"""Paths of the package, its cache and `package://` files; reading with limits; a cache of what has been read."""

from __future__ import annotations

import os
import stat
import sysconfig
from collections import OrderedDict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from drone_sim.message_text import shown

_HERE = Path(__file__).resolve()
MEBIBYTE = 2**20


def package_path() -> Path:
    """Return the folder that contains config/, urdf/ and package.xml. Needs no ROS environment."""
    # This file is src/drone_sim/files/resources.py, or, if installed, lib/python3/dist-packages/drone_sim/files/….
    # The slices allow for a checkout directly below /, which has no sixth parent.
    for folder in (*_HERE.parents[3:4], *(prefix / "share" / "drone_sim" for prefix in _HERE.parents[5:6])):
        if (folder / "package.xml").is_file():
            return folder
    raise FileNotFoundError(f"drone_sim: no config, urdf and package.xml near {_HERE.parent}")


def python_path(*others: str) -> str:
    """Return a PYTHONPATH with which a child process imports this package and its dependencies as this process does.

    The environment's packages come first: an installed package is in the folder of the system's older packages.
    """
    return os.pathsep.join(filter(None, (sysconfig.get_path("purelib"), str(_HERE.parents[2]), *others)))


def cache_path() -> Path:
    """Return the folder for files that may be deleted at any time, below XDG_CACHE_HOME or ~/.cache."""
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "drone_sim"


def is_file(path: Path) -> bool:
    """Return whether `path` is a regular file; False also for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # the name is too long, or contains a NUL
        return False


def locate(name: str) -> Path:
    """Return the path of `package://PACKAGE/...` or `~/...`; any other path unchanged.

    Raises FileNotFoundError, in one line, if the package or the home folder does not exist.
    """
    if name.startswith("package://"):
        return _in_package(name)
    try:
        return Path(name).expanduser()
    except RuntimeError:
        raise FileNotFoundError(f"{shown(name)}: this user's home folder does not exist") from None


def resolve(name: str) -> Path:
    """Return the absolute path of a regular file; `name` is as for `locate`.

    Raises FileNotFoundError, in one line, if the package or the file does not exist.
    """
    path = locate(name)
    try:
        if path.is_file():
            return path.resolve()
        odd = " (it is not a regular file)" if path.exists() else ""
    except (OSError, ValueError):  # the name is too long, or contains a NUL
        odd = ""
    shown_name = f": {name}" if name.isprintable() and len(name) < 300 else ""
    raise FileNotFoundError(f"no such file{shown_name}{odd}")


def read_bytes(path: str | Path, limit: int) -> bytes:
    """Return the content of a regular file of at most `limit` bytes.

    Raises OSError and, in one line without the file's name, ValueError.
    """
    # open() would block on a FIFO without a writer, and os.fdopen does not close a folder that it refuses.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise ValueError("must be a regular file")
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            content = file.read(limit + 1)
    finally:
        os.close(descriptor)
    if len(content) > limit:
        raise ValueError(f"larger than {limit / MEBIBYTE:g} MiB, the limit for such a file")
    return content


def _in_package(name: str) -> Path:
    package, _, rest = name[len("package://") :].partition("/")
    if package == "drone_sim":
        return package_path() / rest
    try:
        import rospkg  # only other packages need the ROS environment

        return Path(rospkg.RosPack().get_path(package)) / rest
    except ImportError:
        raise FileNotFoundError(f"finding a ROS package needs ROS (in {shown(name)})") from None
    except rospkg.ResourceNotFound:
        raise FileNotFoundError(f"no ROS package {package:.60} (in {shown(name)})") from None


T = TypeVar("T")
FileIdentity = tuple[int, int, int] | None  # modification time (ns), size (bytes), inode


class ReadFile(NamedTuple):
    """Value read from a file, its memory in bytes, and the other files that it depends on."""

    value: Any
    size: int
    files: Iterable[str] = ()


class FileCache(Generic[T]):
    """Least recently used cache of what `read` returns for a path, up to `limit` bytes.

    A file is read again if it, or a file that it depends on, has changed.
    """

    def __init__(self, read: Callable[[str], ReadFile], limit: int):
        self._read = read
        self._limit = limit
        self._cached: OrderedDict[str, tuple[ReadFile, dict[str, FileIdentity]]] = OrderedDict()

    def get(self, path: str) -> T:
        """Return the value of a file as it is now. Raises what `read` raises."""
        cached = self._cached.get(path)
        if cached is None or any(identity_of(file) != identity for file, identity in cached[1].items()):
            before = identity_of(path)
            file_read = self._read(path)
            cached = (file_read, {path: before, **{file: identity_of(file) for file in file_read.files}})
            self._cached[path] = cached
        self._cached.move_to_end(path)
        while len(self._cached) > 1 and sum(entry.size for entry, _ in self._cached.values()) > self._limit:
            self._cached.popitem(last=False)
        value: T = cached[0].value
        return value


def identity_of(path: str) -> FileIdentity:
    """Return a value that changes when the file is written; None if there is no such file."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
