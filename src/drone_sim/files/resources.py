"""Where the files of the package lie, in the source tree or installed under share/; and how a file is read."""

from __future__ import annotations

import os
import stat
import sysconfig
from pathlib import Path

from drone_sim.wording import shown

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


def locate(name: str) -> Path:
    """Return the path behind `package://PACKAGE/...` or `~/...`; any other path as it is.

    Raises FileNotFoundError, in one line, where there is no such package or home.
    """
    if name.startswith("package://"):
        return _in_package(name)
    try:
        return Path(name).expanduser()
    except RuntimeError:
        raise FileNotFoundError(f"no such home: {shown(name)}") from None


def resolve(name: str) -> Path:
    """Return the absolute path of a regular file, given as for `locate`.

    Raises FileNotFoundError, in one line, where there is no such package or file.
    """
    path = locate(name)
    try:
        if path.is_file():
            return path.resolve()
        odd = " (it is no regular file)" if path.exists() else ""
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
        raise ValueError(f"larger than {limit / MEBIBYTE:g} MiB, the most that is read of such a file")
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
