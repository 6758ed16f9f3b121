"""The bubblewrap sandbox of scripts: they read only what they need, and have no network and no other processes."""

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
from drone_sim.grading.jobs.files import MAX_SIZE
from drone_sim.grading.jobs.server import HANDED_IN

TEMPORARY = "/dev/shm"  # the only writable folder, in memory
_TRIAL_TIMEOUT = 20.0  # s, on a busy machine; usually a trial takes 10 ms
# Without /dev/zero, whose memory counts for no process, and the graphics card: the judge renders the cameras.
_DEVICES = ("/dev/null", "/dev/random", "/dev/urandom")
_VARIABLES = ("PYTHONPATH", "LD_LIBRARY_PATH")  # their folders are readable
_TASKS = "tasks"
_MIB = 2**20
_ROOT = ("/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")  # links on most systems
# Without other folders of /usr: an administrator may keep a course there.
_SYSTEM = (
    *(f"/usr/{name}" for name in ("bin", "sbin", "lib", "lib32", "lib64", "libx32", "libexec", "share")),
    *("/usr/local/bin", "/usr/local/lib"),
    *(f"/etc/{name}" for name in ("alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "fonts")),
    *("/etc/glvnd", "/etc/drirc", "/etc/python3", f"/etc/python{sysconfig.get_python_version()}"),
)
_PYTHON_FOLDERS = ("bin", "lib", "lib32", "lib64", "libexec", "share", "etc", "pyvenv.cfg")  # below a prefix of Python


class NoSandbox(OSError):
    """bubblewrap is not installed, or does not work here; one line says why."""


def command(files: int) -> list[str]:
    """Return the arguments that run a command in the sandbox, with `files` MiB in TEMPORARY.

    The command can read Python, what Python imports, and this package. Raises NoSandbox.
    """
    program, reason = _find_program()
    if reason:
        raise NoSandbox(reason)
    return _arguments(program, files)


def check_hidden(path: str) -> None:
    """Raise NoSandbox if scripts could read a plan or a submission, because a folder in _VARIABLES contains it."""
    file = Path(path).resolve()
    if not file.is_file() or file.is_relative_to((package_path() / _TASKS).resolve()):  # hidden anyway
        return
    for name in _VARIABLES:
        for folder in _folders_in(name):
            if file.is_relative_to(Path(folder).resolve()):
                raise NoSandbox(f"{name} has {folder}, so that every script could read {path}: remove it from {name}")


def _folders_in(variable: str) -> Iterator[str]:
    yield from (path for path in os.environ.get(variable, "").split(os.pathsep) if os.path.isabs(path))


@functools.cache
def _find_program() -> tuple[str, str]:
    """Return the program bwrap, and the reason why it cannot be used or ''."""
    program = shutil.which("bwrap")
    if program is None:
        return "", "bubblewrap is not installed (Debian's package bubblewrap)"
    try:
        trial = subprocess.run(
            [*_arguments(program, 1), sys.executable, "-S", "-c", ""],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TRIAL_TIMEOUT,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", f"bubblewrap does not work here: {error}"
    if trial.returncode:
        message = " ".join(trial.stderr.decode(errors="replace").split()).partition(". See <")[0]
        return "", f"bubblewrap does not work here: {message:.200} (docs/grading.md, *What is kept out*)"
    return program, ""


def _arguments(program: str, files: int) -> list[str]:
    devices = (word for name in _DEVICES for word in ("--dev-bind", name, name))
    here = os.getcwd()
    return [
        program,
        # The first process in the sandbox cannot be killed or stopped from within, and all others end with it. There
        # is no network, which also means no abstract sockets of others.
        *("--unshare-all", "--as-pid-1", "--die-with-parent", "--new-session", "--cap-drop", "ALL"),
        *_visible_files(),
        *("--proc", "/proc", "--tmpfs", "/dev", *devices, "--symlink", "/proc/self/fd", "/dev/fd"),
        *("--size", str(files * _MIB), "--tmpfs", TEMPORARY, "--size", str(2 * MAX_SIZE), "--tmpfs", HANDED_IN),
        *(word for name in ("/tmp", "/run", here) for word in ("--dir", name)),  # empty folders
        *(word for name in ("/dev", package_path() / _TASKS, "/") for word in ("--remount-ro", str(name))),
        *("--chdir", here, "--"),
    ]


@functools.cache
def _visible_files() -> tuple[str, ...]:
    """Return the arguments that make the libraries of the system and of Python, and this package, readable."""
    arguments: list[str] = []
    for path in map(Path, _ROOT):
        if path.is_symlink():
            arguments += "--symlink", os.readlink(path), str(path)
        elif path.is_dir():
            arguments += "--ro-bind", str(path), str(path)
    bound: list[Path] = []
    for path in map(Path, (*_SYSTEM, *_python_files(), *_package_files())):
        if path.exists() and not any(path.is_relative_to(folder) for folder in bound):
            bound.append(path)
            arguments += "--ro-bind", str(path), str(path)
    # The folder of the tasks, with their solutions, is hidden: a submission gets its own files in HANDED_IN.
    return (*arguments, "--tmpfs", str(package_path() / _TASKS))


def _python_files() -> Iterator[str]:
    """Yield the folders of this Python (pyenv's, conda's, a venv's) and those from which it imports."""
    for prefix in dict.fromkeys((sys.prefix, sys.exec_prefix, sys.base_prefix, os.path.realpath(sys.base_prefix))):
        yield from (os.path.join(prefix, name) for name in _PYTHON_FOLDERS)
    yield from sysconfig.get_paths().values()
    yield from site.getsitepackages()
    if site.ENABLE_USER_SITE:
        yield site.getusersitepackages()
    for name in _VARIABLES:
        yield from _folders_in(name)
    program = sys.executable
    while os.path.islink(program):  # a venv's program is a link to another Python, which may be a link, too
        program = os.path.join(os.path.dirname(program), os.readlink(program))
        yield os.path.normpath(program)


def _package_files() -> Iterator[str]:
    """Yield this package's own files without the tasks, which are beside them in a checkout."""
    yield str(Path(__file__).resolve().parents[2])
    yield from (str(package_path() / name) for name in ("config", "urdf", "package.xml"))
