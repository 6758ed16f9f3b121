"""Protection of the process from mistakes of a Python child script (not from attacks: it is trusted code)."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NoReturn

from drone_sim.scripting import script_log, time_limit

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
    """End this process, a copy that a script has made by `os.fork`: it would also fly, and answer in our name."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(_UNTIL_SAID)
    try:
        script_log.say(f"{path}: the process that os.fork() made has returned from the script, and is ended")
    finally:
        os._exit(1)


@contextlib.contextmanager
def process_kept() -> Iterator[None]:
    """Give signal handlers and standard streams back to the process afterwards."""
    sys.setrecursionlimit = _guarded
    for module, name, function in _GUARDED:
        setattr(module, name, function)
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
        raise ValueError(f"the recursion limit of a child script must be at most {_DEEPEST}, not {limit}")
    _set_recursion_limit(limit)


# ---- what the time limit needs of the process, while a script runs


def _kept_from_scripts(name: str, takes: Callable[..., bool]) -> Any:
    function = getattr(signal, name)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        if time_limit.running() is not None and takes(*arguments):
            raise ValueError(f"signal.{name}: the time limit of scripts (script_time_limit) uses this alarm")
        return function(*arguments)

    return call


@functools.wraps(signal.pthread_sigmask)
def _mask(how: int, mask: Iterable[int]) -> Any:
    """Block what a script asks for, apart from the alarm."""
    if time_limit.running() is not None and how != signal.SIG_UNBLOCK:
        mask = set(mask) - {signal.SIGALRM}
    return _pthread_sigmask(how, mask)


def _tracing(function: Callable[[Any], None]) -> Any:
    """Return a version whose trace function is removed when the script has returned: it traces only the script."""

    @functools.wraps(function)
    def call(trace: Any) -> None:
        limit = time_limit.running()
        if limit is not None and limit.traces is None:
            limit.traces = sys.gettrace(), sys.getprofile()
        function(trace)

    return call


_pthread_sigmask = signal.pthread_sigmask
_GUARDED: tuple[tuple[Any, str, Any], ...] = (
    (signal, "signal", _kept_from_scripts("signal", lambda number, *_: number == signal.SIGALRM)),
    (signal, "setitimer", _kept_from_scripts("setitimer", lambda which, *_: which == signal.ITIMER_REAL)),
    (signal, "alarm", _kept_from_scripts("alarm", lambda *_: True)),
    (signal, "pthread_sigmask", _mask),
    (sys, "settrace", _tracing(sys.settrace)),
    (sys, "setprofile", _tracing(sys.setprofile)),
)
