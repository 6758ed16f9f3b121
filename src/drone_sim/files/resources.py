"""Files: where they are, what is in them, and what was read of them, kept while they stay as they are."""

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
    """Return the folder that holds config/, urdf/ and package.xml. Needs no ROS environment."""
    # src/drone_sim/files/resources.py, or lib/python3/dist-packages/drone_sim/files/resources.py when installed.
    # A checkout directly below / has no sixth parent.
    for folder in (*_HERE.parents[3:4], *(prefix / "share" / "drone_sim" for prefix in _HERE.parents[5:6])):
        if (folder / "package.xml").is_file():
            return folder
    raise FileNotFoundError(f"drone_sim: no config, urdf and package.xml near {_HERE.parent}")


def python_path(*others: str) -> str:
    """Return a PYTHONPATH with which another process of this python imports this package, and what it needs, as here.

    Where the package is installed, the system's packages lie beside it, and are older than those of our environment.
    """
    return os.pathsep.join(filter(None, (sysconfig.get_path("purelib"), str(_HERE.parents[2]), *others)))


def cache_path() -> Path:
    """Return the folder for what may be deleted at any time: of ours, below ~/.cache or XDG_CACHE_HOME."""
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "drone_sim"


def is_file(path: Path) -> bool:
    """Tell whether there is a regular file of this name; False also for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long a name, a NUL in it
        return False


def locate(name: str) -> Path:
    """Return the path behind `package://PACKAGE/...` or `~/...`; any other path as it is.

    Raises FileNotFoundError, in one line, where there is no such package or home.
    """
    if name.startswith("package://"):
        return _in_package(name)
    try:
        return Path(name).expanduser()
    except RuntimeError:
        raise FileNotFoundError(f"{shown(name)}: this user's home folder does not exist") from None


def resolve(name: str) -> Path:
    """Return the absolute path of a regular file, given as for `locate`.

    Raises FileNotFoundError, in one line, where there is no such package or file.
    """
    path = locate(name)
    try:
        if path.is_file():
            return path.resolve()
        odd = " (it is not a regular file)" if path.exists() else ""
    except (OSError, ValueError):  # too long a name, a NUL in it
        odd = ""
    named = f": {name}" if name.isprintable() and len(name) < 300 else ""
    raise FileNotFoundError(f"no such file{named}{odd}")


def read_bytes(path: str | Path, limit: int) -> bytes:
    """Return what a file holds. It must be a regular one, not larger than `limit` bytes.

    Raises OSError and, in one line without the file's name, ValueError.
    """
    # A FIFO without a writer would hold up a plain open(), and os.fdopen keeps a folder open that it refuses.
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
ObjectLabel = tuple[int, int, int] | None  # modification time (ns), size (bytes), inode


class ReadFile(NamedTuple):
    """What a file held, how much memory it takes (bytes), and what other files it depends on."""

    value: Any
    size: int
    files: Iterable[str] = ()


class FileCache(Generic[T]):
    """Reads files by path; the ones used last stay, up to `limit` bytes."""

    def __init__(self, read: Callable[[str], ReadFile], limit: int):
        """Take what reads a file."""
        self._read = read
        self._limit = limit
        self._kept: OrderedDict[str, tuple[ReadFile, dict[str, ObjectLabel]]] = OrderedDict()

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


def identity_of(path: str) -> ObjectLabel:
    """Return what changes when a file is written anew; None where there is no such file."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
