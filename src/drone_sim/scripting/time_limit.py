"""Stops a runaway script.

A Lua script asks `exceeded` from a hook that counts instructions. A Python script runs in the simulation's own
thread, and an exception has to stop it. In the main thread the handler of a kernel timer raises it; this also stops C
code that waits or takes long, if it checks for signals (sleep, locks, sockets, `re`). In any other thread a watchdog
sets the exception, which Python raises between two of its instructions.
"""

from __future__ import annotations

import array
import atexit
import contextlib
import ctypes
import functools
import math
import os
import signal
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from threading import get_ident
from time import monotonic
from types import FrameType
from typing import Any

_POLL = 0.05  # s between two looks of the watchdog
_AGAIN = 0.25  # s after which a script that swallowed the exception gets another
_UNTIL_HEARD = 0.01  # s between two tries to begin: a recursion may leave no room for a signal handler
_LATER = 0.001  # s, so that the time is used up when the timer goes off
_LONGEST = 1e6  # s
_SOONEST = 1e-4  # s; 0 would switch the timer off

# What a process outside may see (see watched_by): when the script that runs has to return (monotonic clock), or 0;
# and which one it is.
_seen: Any = array.array("d", (0.0, 0.0))
_texts: Any = None
_numbers: dict[str, int] = {}  # of what such a process would say of a script
_LONGEST_TEXT = 512  # bytes
_MOST_TEXTS = 2048
WATCHED = 16 + _MOST_TEXTS * _LONGEST_TEXT  # bytes of memory

_signal, _setitimer = signal.signal, signal.setitimer
_set_trace, _set_profile = sys.settrace, sys.setprofile
_ROOM = 50  # levels of recursion that the signal handler has beyond what the script may use

_set_recursion_limit = sys.setrecursionlimit
_raise_in_thread = ctypes.PyDLL(None).PyThreadState_SetAsyncExc
_raise_in_thread.argtypes = (ctypes.c_ulong, ctypes.py_object)
_NOTHING = ctypes.py_object()  # NULL
# Trace functions, called with a frame, an event and an argument. Written in C: in one written in Python the exception
# would be raised at once, or there might be too little room for it, and then it would be the thread's no more.
_insist = ctypes.PyDLL(None).PyThreadState_SetAsyncExc
_insist.argtypes, _insist.restype = (*_raise_in_thread.argtypes, *3 * (ctypes.py_object,)), None
_let_pass = ctypes.PyDLL(None).Py_IsInitialized  # for new frames, such as __exit__: they end by themselves
_let_pass.argtypes, _let_pass.restype = 3 * (ctypes.py_object,), None


class ScriptStopped(BaseException):
    """Raised in a script that ran for too long; no Exception, so that `except Exception` lets it pass."""


class Labels(dict[str, int]):
    """Numbers of a script's phases, by which a process outside knows what runs."""

    def __init__(self, path: str, limit: TimeLimit):
        """Take the script's path, and its limit."""
        super().__init__()
        self._path, self._limit = path, limit

    def __missing__(self, phase: str) -> int:
        """Give the phase a number, and store the error message for the case that it never returns."""
        text = f"[{phase}] {self._path}: did not return after {self._limit.seconds:g} s (script_time_limit)"
        number = self[phase] = _numbers.setdefault(text, len(_numbers))
        _write_text(number, text)
        return number


def watched_by(memory: Any) -> None:
    """Let a process outside see which script runs: take WATCHED bytes of writable memory, shared with it."""
    global _seen, _texts
    view = memoryview(memory)
    _seen, _texts = view[:16].cast("d"), view[16:]
    for text, number in _numbers.items():
        _write_text(number, text)


def overdue(memory: Any) -> tuple[float, int]:
    """Return, in the process outside, the deadline of the script that runs (0: none runs), and its number."""
    numbers = memoryview(memory)[:16].cast("d")
    return numbers[0], int(numbers[1])


def text_of(memory: Any, number: int) -> str:
    """Return, in the process outside, the error message for that number."""
    text = bytes(memoryview(memory)[16 + number * _LONGEST_TEXT :][:_LONGEST_TEXT]).rstrip(b"\0")
    return text.decode("utf-8", "ignore") or "a script did not return within script_time_limit"


def _write_text(number: int, text: str) -> None:
    if _texts is not None and number < _MOST_TEXTS:
        line = " ".join(text.encode("utf-8", "backslashreplace").decode().split()).encode()[-_LONGEST_TEXT:]
        _texts[number * _LONGEST_TEXT :][: len(line)] = line


class TimeLimit:
    """How long a script may run before it has to return; one script at a time."""

    def __init__(self, seconds: float):
        """Take the limit in seconds of real time; 0 means none."""
        self.seconds = seconds
        self.label = _MOST_TEXTS - 1  # of Labels
        self.struck = False  # whether the last script that `run` called was stopped
        self._deadline = 0.0
        self._expired = False
        self._carry: Callable[[Callable[[], Any]], Any] | None = None
        self._traced_by: Any = None  # a debugger's trace function, which comes back afterwards
        self.traces: tuple[Any, Any] | None = None  # before the script set one: it may trace itself, nobody else
        self._thread = 0
        # The script's thread writes `armed` (a script runs) and then reads `fired`, the watchdog the other way round:
        # so one of the two sees the other, without a lock in every call.
        self.armed = False
        self._fired = False
        self._firing = threading.Lock()

    def __str__(self) -> str:
        """Say what was exceeded."""
        return f"stopped after {self.seconds:g} s without returning (script_time_limit)"

    def start(self) -> None:
        """Begin to count."""
        self._expired = False
        self._deadline = monotonic() + self.seconds

    def show(self) -> None:
        """Let a process outside see when the script has to return."""
        if self.seconds:
            _seen[1], _seen[0] = self.label, self._deadline

    def hide(self) -> None:
        """Let the process outside see that no script runs."""
        _seen[0] = 0.0

    def exceeded(self) -> bool:
        """Tell whether the time since `start` is used up."""
        return self._expired or (self.seconds > 0 and monotonic() > self._deadline)

    def left(self) -> float:
        """Return how many seconds are left, negative where none are; infinite without a limit."""
        return self._deadline - monotonic() if self.seconds > 0 or self._expired else math.inf

    def expire(self) -> None:
        """Let the time be used up now."""
        self._expired = True
        self._deadline = monotonic()

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Do not count what happens inside: it is the simulator's time, not the script's."""
        began, armed, is_seen = monotonic(), self.armed, _seen[0] != 0.0
        self.armed = False
        self.hide()
        try:
            yield
        finally:
            self._deadline += monotonic() - began
            self.armed = armed
            if is_seen:
                self.show()

    def carry_with(self, carry: Callable[[Callable[[], Any]], Any]) -> None:
        """Take what calls a function in the simulation's thread, for a script that runs in another one."""
        self._carry = carry

    def outside(self, function: Callable[[], Any]) -> Any:
        """Call a function of the simulator for the script: in the simulation's thread, and not counted."""
        if self._carry is not None:
            return self._carry(function)
        with self.paused():
            return function()

    def inside(self, function: Callable[[], Any]) -> Any:
        """Do what `outside` does, for another script that this one calls: its time is this one's, too."""
        deadline = self._deadline
        try:
            return self.outside(function)
        finally:
            self._deadline = deadline
            if _seen[0]:
                self.show()
            if self.armed and self.seconds and get_ident() == _MAIN:  # the timer was the other one's
                _timer.limit = self
                _timer.set(max(0.0, self.left()) + _LATER)

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a Python function; raises ScriptStopped where it does not return in time."""
        now = monotonic()
        self._deadline = now + self.seconds
        self.struck = False
        self._thread = get_ident()
        if self.seconds:
            _seen[1], _seen[0] = self.label, self._deadline
        if self._thread != _MAIN:
            _watch(self)
        elif self.seconds:
            _timer.limit = self
            if not now < _timer.next <= self._deadline:  # where it should have gone off, somebody has switched it off
                _timer.set(self.seconds)
        try:
            try:
                self.armed = True
                return function(*arguments)
            finally:
                if self.traces:  # now, and without a call of a function in Python: what traces may not return
                    _set_trace(self.traces[0])
                    _set_profile(self.traces[1])
                    self.traces = None
                self.armed = False
                _seen[0] = 0.0
                if self.struck or self._fired:
                    self._end_strike()
        except ScriptStopped:
            # It may have struck between the end of the function and the beginning of `finally`.
            self.armed = False
            self.hide()
            self._end_strike()
            raise

    def _end_strike(self) -> None:
        """Discard an exception that has not been raised yet, and restore the trace function."""
        if sys.gettrace() is _let_pass:
            _set_trace(self._traced_by)
        with contextlib.suppress(ScriptStopped):
            _let_it_come()
        while self._fired:
            try:
                with self._firing:
                    self._fired = False
                    _raise_in_thread(self._thread, _NOTHING)
            except ScriptStopped:
                continue

    def fire_if_late(self) -> None:
        """Stop the script where it is late; the watchdog calls it."""
        if not (self.armed and self.exceeded()):
            return
        with self._firing:
            self._fired = True
            if self.armed and self.exceeded():
                self.struck = True
                self._deadline = monotonic() + _AGAIN
                _raise_in_thread(self._thread, ScriptStopped)
            else:
                self._fired = False

    def strike_if_late(self, frame: FrameType | None) -> None:
        """Raise ScriptStopped in a script that is late, and in the next line of each of its frames, such as `finally`.

        Sets the timer again; the timer's handler calls it.
        """
        if not self.exceeded():
            _timer.set(self.left() + _LATER)
            return
        _timer.set(_AGAIN)
        if not self.struck:
            self.struck, self._traced_by = True, sys.gettrace()
        _set_trace(_let_pass)
        insist = functools.partial(_insist, self._thread, ScriptStopped)
        while frame is not None and frame.f_code is not TimeLimit.run.__code__:
            frame.f_trace = insist
            frame = frame.f_back
        raise ScriptStopped


class _Timer:
    """The process's timer, SIGALRM. It is not set in every call, but goes off and is set anew while scripts run."""

    def __init__(self) -> None:
        self.limit: TimeLimit | None = None  # of the script that runs in the main thread, or did
        self.next = math.inf  # when it goes off
        self._is_ready = False

    def set(self, seconds: float) -> None:
        _signal(signal.SIGALRM, _go_off)
        if not self._is_ready:
            atexit.register(_setitimer, signal.ITIMER_REAL, 0)  # nobody catches it while Python ends
            self._is_ready = True
        self.next = monotonic() + seconds
        # Where the process had to wait for its turn, what was left of the time has passed by now.
        _setitimer(signal.ITIMER_REAL, min(max(seconds, _SOONEST), _LONGEST), _UNTIL_HEARD)

    def forget(self) -> None:
        """Know that it is not set: a process does not inherit the timer of the one that forked it."""
        self.next = math.inf

    def rest(self) -> None:
        """Do not go off any more."""
        self.forget()
        _setitimer(signal.ITIMER_REAL, 0)


_MAIN = threading.main_thread().ident
_timer = _Timer()
os.register_at_fork(after_in_child=_timer.forget)
_watched: weakref.WeakSet[TimeLimit] = weakref.WeakSet()
_watching = threading.Lock()
_watchdog: threading.Thread | None = None


def running() -> TimeLimit | None:
    """Return the limit of the Python script that runs in this thread, the main one; None outside of scripts."""
    limit = _timer.limit
    return limit if limit is not None and limit.armed and limit.seconds and get_ident() == _MAIN else None


def _let_it_come() -> None:
    """Do nothing: at the beginning of the call, Python raises an exception that is pending."""


def _go_off(_number: int, frame: FrameType | None) -> None:
    limit = sys.getrecursionlimit()
    _set_recursion_limit(limit + _ROOM)
    try:
        _setitimer(signal.ITIMER_REAL, 0)  # heard
        if _timer.limit is None or not _timer.limit.armed:
            _timer.rest()
        else:
            _timer.limit.strike_if_late(frame)
    finally:
        _set_recursion_limit(limit)


def _watch(limit: TimeLimit) -> None:
    """Let the watchdog, which starts with the first one, look after a limit for as long as it exists."""
    global _watchdog
    if limit in _watched:
        return
    with _watching:
        _watched.add(limit)
        if _watchdog is None:
            _watchdog = threading.Thread(target=_keep_watch, name="script time limit", daemon=True)
            _watchdog.start()


def _keep_watch() -> None:
    while True:
        time.sleep(_POLL)
        with _watching:
            limits = list(_watched)
        for limit in limits:
            limit.fire_if_late()
