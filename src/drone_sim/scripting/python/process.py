"""Protection of the process from mistakes of a Python child script (not from attacks: the script is trusted)."""

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
_DEEPEST = 10_000  # levels of recursion that fit into a stack of 8 MiB; with more, the process would crash

_LOG_TIMEOUT = 1  # s: a lock of the log may be held by a thread that does not exist in the copy

_set_recursion_limit = sys.setrecursionlimit


class Forks:
    """Number of calls of `os.fork` between the first process and this one, without those of subprocess."""

    count = 0


def _count_fork() -> None:
    Forks.count += 1


os.register_at_fork(after_in_child=_count_fork)


def end_copy(path: str) -> NoReturn:
    """End this process, a copy that a script has made by `os.fork`: otherwise it would also fly and answer clients."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(_LOG_TIMEOUT)
    try:
        script_log.say(f"{path}: the process that os.fork() made has returned from the script, and is ended")
    finally:
        os._exit(1)


@contextlib.contextmanager
def process_kept() -> Iterator[None]:
    """Restore signal handlers and standard streams at the end of the context."""
    sys.setrecursionlimit = _set_limited_recursion
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


def _set_limited_recursion(limit: int) -> None:
    """Set the recursion limit. Raises ValueError if the stack is too small for it."""
    if limit > _DEEPEST:
        raise ValueError(f"the recursion limit of a child script must be at most {_DEEPEST}, not {limit}")
    _set_recursion_limit(limit)


# ---- functions that a running script may only call in part, because the time limit needs the alarm


def _without_alarm(name: str, takes: Callable[..., bool]) -> Any:
    function = getattr(signal, name)

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        if time_limit.running() is not None and takes(*arguments):
            raise ValueError(f"signal.{name}: the time limit of scripts (script_time_limit) uses this alarm")
        return function(*arguments)

    return call


@functools.wraps(signal.pthread_sigmask)
def _mask(how: int, mask: Iterable[int]) -> Any:
    """Like pthread_sigmask, but never block the alarm while a script runs."""
    if time_limit.running() is not None and how != signal.SIG_UNBLOCK:
        mask = set(mask) - {signal.SIGALRM}
    return _pthread_sigmask(how, mask)


def _tracing(function: Callable[[Any], None]) -> Any:
    """Return a version of settrace or setprofile whose trace function is removed when the script has returned."""

    @functools.wraps(function)
    def call(trace: Any) -> None:
        limit = time_limit.running()
        if limit is not None and limit.traces is None:
            limit.traces = sys.gettrace(), sys.getprofile()
        function(trace)

    return call


_pthread_sigmask = signal.pthread_sigmask
_GUARDED: tuple[tuple[Any, str, Any], ...] = (
    (signal, "signal", _without_alarm("signal", lambda number, *_: number == signal.SIGALRM)),
    (signal, "setitimer", _without_alarm("setitimer", lambda which, *_: which == signal.ITIMER_REAL)),
    (signal, "alarm", _without_alarm("alarm", lambda *_: True)),
    (signal, "pthread_sigmask", _mask),
    (sys, "settrace", _tracing(sys.settrace)),
    (sys, "setprofile", _tracing(sys.setprofile)),
)
