"""What of the process a Python child script must not spoil, though it is trusted code: by mistake, that is."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from typing import NoReturn

from drone_sim.scripting import script_log

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STREAMS = ("stdin", "stdout", "stderr")
_DEEPEST = 10_000  # levels of recursion that fit into a stack of 8 MiB; beyond, the process would crash

_UNTIL_SAID = 1  # s: another thread may have held what the log needs, and is not in the copy

_set_recursion_limit = sys.setrecursionlimit


class Forks:
    """How often `os.fork` has made this process; a subprocess's own fork does not count."""

    count = 0


def _count_fork() -> None:
    Forks.count += 1


os.register_at_fork(after_in_child=_count_fork)


def end_copy(path: str) -> NoReturn:
    """End this process, which a script made by `os.fork` and let go on: it would fly, too, and answer in our name."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(_UNTIL_SAID)
    try:
        script_log.say(f"{path}: the copy that os.fork() made has come back from the script, and ends: one flies")
    finally:
        os._exit(1)


@contextlib.contextmanager
def process_kept() -> Iterator[None]:
    """Give signal handlers and standard streams back to the process afterwards."""
    sys.setrecursionlimit = _guarded
    streams = [getattr(sys, name) for name in _STREAMS]
    handlers = [(number, signal.getsignal(number)) for number in _SIGNALS]
    try:
        yield
    finally:
        for name, stream in zip(_STREAMS, streams):
            setattr(sys, name, stream)
        if threading.current_thread() is threading.main_thread():
            for number, handler in handlers:
                if handler is not None and signal.getsignal(number) is not handler:
                    signal.signal(number, handler)


def _guarded(limit: int) -> None:
    """Set the recursion limit; raises ValueError beyond what the stack holds."""
    if limit > _DEEPEST:
        raise ValueError(f"a child script's recursion limit is {_DEEPEST} at most, not {limit}")
    _set_recursion_limit(limit)
