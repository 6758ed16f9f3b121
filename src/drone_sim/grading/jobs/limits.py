"""What the process of a flight takes upon itself before a script runs in it: limits that it cannot lift again."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
from pathlib import Path

_MIB = 2**20
_RESERVED = 2048  # MiB of addresses beyond what is written to: libraries reserve more than they use
_LIFETIME = 1  # s of processor time after SIGXCPU, which a script may ignore
_LIBC = ctypes.CDLL(None, use_errno=True)
_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_CHILD_SUBREAPER, _PR_SET_NO_NEW_PRIVS = 1, 4, 36, 38


def impose(seconds: float, memory: int, files: int, processes: int, open_files: int) -> None:
    """Limit this process, and what it begins, for good: s of processor time, MiB, MiB of a file, numbers.

    Memory is counted from what the process has now. Not the addresses (RLIMIT_AS) are what is limited first, of which
    OpenGL reserves many and uses few, but the pages that are its own (RLIMIT_DATA); addresses are limited to more
    than that, for memory that is shared is not counted among the pages. A crash leaves no core.
    """
    own, addresses = _memory()
    seconds = max(1, round(seconds))
    for what, limit in (
        (resource.RLIMIT_CPU, (seconds, seconds + _LIFETIME)),
        (resource.RLIMIT_DATA, own + memory * _MIB),
        (resource.RLIMIT_AS, addresses + (memory + _RESERVED) * _MIB),
        (resource.RLIMIT_NPROC, _tasks_of_user() + processes),
        (resource.RLIMIT_NOFILE, open_files),
        (resource.RLIMIT_FSIZE, files * _MIB),
        (resource.RLIMIT_CORE, 0),
    ):
        _limit(what, limit if isinstance(limit, tuple) else (limit, limit))


def end_with_parent() -> None:
    """Let the kernel kill this process when the one that forked it ends, and gain no rights by set-user-ID programs."""
    _prctl(_PR_SET_DUMPABLE, 1)  # or its own /proc/self/fd is closed to it
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)


def guard() -> None:
    """Let nobody of the same user look into this process, and give it what its children leave behind."""
    _prctl(_PR_SET_DUMPABLE, 0)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def _limit(what: int, limit: tuple[int, int]) -> None:
    hard = resource.getrlimit(what)[1]
    if hard != resource.RLIM_INFINITY:
        limit = (min(limit[0], hard), min(limit[1], hard))
    resource.setrlimit(what, limit)


def _memory() -> tuple[int, int]:
    """Return the bytes of this process's own pages and of its addresses, as the limits count them."""
    status = Path("/proc/self/status").read_text()
    own, addresses = (int(status.partition(f"{name}:")[2].split()[0]) for name in ("VmData", "VmSize"))
    return own * 1024, addresses * 1024


def _tasks_of_user() -> int:
    """Return how many threads of this user's processes there are, among which RLIMIT_NPROC counts new ones."""
    count, user = 0, os.getuid()
    for entry in os.scandir("/proc"):
        try:
            if entry.name.isdigit() and entry.stat().st_uid == user:
                count += len(os.listdir(f"/proc/{entry.name}/task"))
        except OSError:  # it has ended
            continue
    return count


def _prctl(option: int, value: int) -> None:
    if _LIBC.prctl(option, ctypes.c_ulong(value), *(ctypes.c_ulong(0),) * 3):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
