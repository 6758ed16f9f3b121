"""bubblewrap around the process that flies: no network, no file to change, no other process in sight."""

from __future__ import annotations

import functools
import shutil
import subprocess
from pathlib import Path

TEMPORARY = "/dev/shm"  # the one folder to write to, in memory
_TRIED = 20.0  # s, on a busy machine; it takes some 10 ms
_DEVICES = Path("/dev/dri")  # of the graphics card, which cameras may draw with


class NoSandbox(OSError):
    """bubblewrap is not there, or does not work here; one line says why."""


def command(files: int) -> list[str]:
    """Return what to put before a command so that it runs in the sandbox, with so many MiB in TEMPORARY.

    Raises NoSandbox.
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
            [*_wrapped(program, 1), "true"], stdin=subprocess.DEVNULL, capture_output=True, timeout=_TRIED, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", f"bubblewrap does not work here: {error}"
    if tried.returncode:
        said = " ".join(tried.stderr.decode(errors="replace").split())
        return "", f"bubblewrap does not work here: {said:.200}"
    return program, ""


def _wrapped(program: str, files: int) -> list[str]:
    devices = ("--dev-bind", str(_DEVICES), str(_DEVICES)) if _DEVICES.exists() else ()
    return [
        program,
        # The first of its processes cannot be killed or stopped from within, and with it all others end.
        *("--unshare-all", "--as-pid-1", "--die-with-parent", "--new-session", "--cap-drop", "ALL"),
        *("--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", *devices),
        *("--size", str(files * 2**20), "--tmpfs", TEMPORARY, "--remount-ro", "/dev"),
        "--",
    ]
