"""bubblewrap around the process that flies: it can read what it needs, nothing else; no network, no other processes."""

from __future__ import annotations

import functools
import os
import shutil
import site
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

from drone_sim.files.resources import package_path
from drone_sim.grading.jobs.files import LARGEST
from drone_sim.grading.jobs.server import HANDED_IN

TEMPORARY = "/dev/shm"  # the one folder to write to, in memory
_TRIED = 20.0  # s, on a busy machine; it takes some 10 ms
# Not /dev/zero, whose memory counts for no process, nor the graphics card: cameras are rendered by the judge.
_DEVICES = ("/dev/null", "/dev/random", "/dev/urandom")
_TASKS = "tasks"
_MIB = 2**20
_ROOT = ("/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")  # links, on most systems
# Not what else is below /usr: whoever manages the system may keep a course there.
_SYSTEM = (
    *(f"/usr/{name}" for name in ("bin", "sbin", "lib", "lib32", "lib64", "libx32", "libexec", "share")),
    *("/usr/local/bin", "/usr/local/lib"),
    *(f"/etc/{name}" for name in ("alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "fonts")),
    *("/etc/glvnd", "/etc/drirc", "/etc/python3", f"/etc/python{sysconfig.get_python_version()}"),
)
_OF_PYTHON = ("bin", "lib", "lib32", "lib64", "libexec", "share", "etc", "pyvenv.cfg")  # in the folder it lies in


class NoSandbox(OSError):
    """bubblewrap is not there, or does not work here; one line says why."""


def command(files: int) -> list[str]:
    """Return what to put before a command so that it runs in the sandbox, with so many MiB in TEMPORARY.

    It reads Python, what Python imports, and this package. Raises NoSandbox.
    """
    program, why = _found()
    if why:
        raise NoSandbox(why)
    return _wrapped(program, files)


@functools.cache
def _found() -> tuple[str, str]:
    """Return the program, and why it is of no use or ''."""
    program = shutil.which("bwrap")
    if program is None:
        return "", "bubblewrap is not installed (Debian's package bubblewrap)"
    try:
        tried = subprocess.run(
            [*_wrapped(program, 1), sys.executable, "-S", "-c", ""],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TRIED,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", f"bubblewrap does not work here: {error}"
    if tried.returncode:
        said = " ".join(tried.stderr.decode(errors="replace").split()).partition(". See <")[0]
        return "", f"bubblewrap does not work here: {said:.200} (docs/grading.md, *What is kept out*)"
    return program, ""


def _wrapped(program: str, files: int) -> list[str]:
    devices = (word for name in _DEVICES for word in ("--dev-bind", name, name))
    here = os.getcwd()
    return [
        program,
        # The first of its processes cannot be killed or stopped from within, and with it all others end. The network
        # is none, of which sockets without a file (abstract ones) are a part.
        *("--unshare-all", "--as-pid-1", "--die-with-parent", "--new-session", "--cap-drop", "ALL"),
        *_shown_system(),
        *("--proc", "/proc", "--tmpfs", "/dev", *devices, "--symlink", "/proc/self/fd", "/dev/fd"),
        *("--size", str(files * _MIB), "--tmpfs", TEMPORARY, "--size", str(2 * LARGEST), "--tmpfs", HANDED_IN),
        *(word for name in ("/tmp", "/run", here) for word in ("--dir", name)),  # which are empty
        *(word for name in ("/dev", package_path() / _TASKS, "/") for word in ("--remount-ro", str(name))),
        *("--chdir", here, "--"),
    ]


@functools.cache
def _shown_system() -> tuple[str, ...]:
    """Return the arguments that show the system's libraries, Python's and this package."""
    said: list[str] = []
    for path in map(Path, _ROOT):
        if path.is_symlink():
            said += "--symlink", os.readlink(path), str(path)
        elif path.is_dir():
            said += "--ro-bind", str(path), str(path)
    shown: list[Path] = []
    for path in map(Path, (*_SYSTEM, *_of_python(), *_of_package())):
        if path.exists() and not any(path.is_relative_to(one) for one in shown):
            shown.append(path)
            said += "--ro-bind", str(path), str(path)
    # The tasks have their solutions beside them; what a plan needs is shown all the same.
    return (*said, "--tmpfs", str(package_path() / _TASKS))


def _of_python() -> Iterator[str]:
    """Yield the folders of this Python and of all that it imports from, wherever they are: pyenv, conda, a venv."""
    for prefix in dict.fromkeys((sys.prefix, sys.exec_prefix, sys.base_prefix, os.path.realpath(sys.base_prefix))):
        yield from (os.path.join(prefix, name) for name in _OF_PYTHON)
    yield from sysconfig.get_paths().values()
    yield from site.getsitepackages()
    if site.ENABLE_USER_SITE:
        yield site.getusersitepackages()
    for name in ("PYTHONPATH", "LD_LIBRARY_PATH"):
        yield from (path for path in os.environ.get(name, "").split(os.pathsep) if os.path.isabs(path))
    program = sys.executable
    while os.path.islink(program):  # a venv's is a link to another's, which may be one, too
        program = os.path.join(os.path.dirname(program), os.readlink(program))
        yield os.path.normpath(program)


def _of_package() -> Iterator[str]:
    """Give this package's own files, but not the tasks, which lie beside them in a checkout."""
    yield str(Path(__file__).resolve().parents[2])
    yield from (str(package_path() / name) for name in ("config", "urdf", "package.xml"))
