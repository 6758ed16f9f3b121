"""Time limit of scripts.

A Lua script checks `exceeded` in a hook that counts instructions. A Python script runs in the simulation's own thread
and is stopped by an exception. In the main thread, the handler of a kernel timer raises it; this also stops C code that
waits or takes long, if it checks for signals (sleep, locks, sockets, `re`). In any other thread, a watchdog sets the
exception, which Python raises between two instructions.
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

_POLL = 0.05  # s between checks of the watchdog
_AGAIN = 0.25  # s after which a script that caught the exception is interrupted again
_RETRY = 0.01  # s until the timer expires again, because a deep recursion may leave no room for a signal handler
_LATER = 0.001  # s added to the timer, so that the time has been used up when it expires
_LONGEST = 1e6  # s
_SOONEST = 1e-4  # s; 0 would switch the timer off

# Read by another process (see watched_by): the deadline of the running script (monotonic clock; 0 if none runs), and
# the number of its error message.
_shared: Any = array.array("d", (0.0, 0.0))
_texts: Any = None
_numbers: dict[str, int] = {}  # by error message
_LONGEST_TEXT = 512  # bytes
_MOST_TEXTS = 2048
WATCHED = 16 + _MOST_TEXTS * _LONGEST_TEXT  # bytes of memory

_signal, _setitimer = signal.signal, signal.setitimer
_set_trace, _set_profile = sys.settrace, sys.setprofile
_ROOM = 50  # levels of recursion that the signal handler may use beyond the script's limit

_set_recursion_limit = sys.setrecursionlimit
_raise_in_thread = ctypes.PyDLL(None).PyThreadState_SetAsyncExc
_raise_in_thread.argtypes = (ctypes.c_ulong, ctypes.py_object)
_NOTHING = ctypes.py_object()  # NULL
# Trace functions, called with a frame, an event and an argument. They are C functions: in a Python function, the
# exception would be raised at once, or a lack of stack space would make it disappear.
_insist = ctypes.PyDLL(None).PyThreadState_SetAsyncExc
_insist.argtypes, _insist.restype = (*_raise_in_thread.argtypes, *3 * (ctypes.py_object,)), None
_let_pass = ctypes.PyDLL(None).Py_IsInitialized  # for new frames, such as __exit__, which end by themselves
_let_pass.argtypes, _let_pass.restype = 3 * (ctypes.py_object,), None


class ScriptStopped(BaseException):
    """Raised in a script that ran for too long; not an Exception, so that `except Exception` does not catch it."""


class Labels(dict[str, int]):
    """Numbers of a script's phases, which tell another process which phase runs."""

    def __init__(self, path: str, limit: TimeLimit):
        super().__init__()
        self._path, self._limit = path, limit

    def __missing__(self, phase: str) -> int:
        """Return a new number for the phase, and store the error message for the case that it never returns."""
        text = f"[{phase}] {self._path}: did not return after {self._limit.seconds:g} s (script_time_limit)"
        number = self[phase] = _numbers.setdefault(text, len(_numbers))
        _write_text(number, text)
        return number


def watched_by(memory: Any) -> None:
    """Show in `memory`, WATCHED bytes that another process shares, which script runs."""
    global _shared, _texts
    view = memoryview(memory)
    _shared, _texts = view[:16].cast("d"), view[16:]
    for text, number in _numbers.items():
        _write_text(number, text)


def overdue(memory: Any) -> tuple[float, int]:
    """Return, in the other process, the deadline of the running script (0: none runs), and its number."""
    numbers = memoryview(memory)[:16].cast("d")
    return numbers[0], int(numbers[1])


def text_of(memory: Any, number: int) -> str:
    """Return, in the other process, the error message with that number."""
    text = bytes(memoryview(memory)[16 + number * _LONGEST_TEXT :][:_LONGEST_TEXT]).rstrip(b"\0")
    return text.decode("utf-8", "ignore") or "a script did not return within script_time_limit"


def _write_text(number: int, text: str) -> None:
    if _texts is not None and number < _MOST_TEXTS:
        line = " ".join(text.encode("utf-8", "backslashreplace").decode().split()).encode()[-_LONGEST_TEXT:]
        _texts[number * _LONGEST_TEXT :][: len(line)] = line


class TimeLimit:
    """Time within which a call of a script must return; for one script at a time."""

    def __init__(self, seconds: float):
        """Set the limit in seconds of real time; 0 means none."""
        self.seconds = seconds
        self.label = _MOST_TEXTS - 1  # number of the phase, from Labels
        self.struck = False  # whether the last script called by `run` was stopped
        self._deadline = 0.0
        self._expired = False
        self._call_outside: Callable[[Callable[[], Any]], Any] | None = None
        self._traced_by: Any = None  # a debugger's trace function, restored afterwards
        self.traces: tuple[Any, Any] | None = None  # trace functions to restore after the script
        self._thread = 0
        # The script's thread writes `armed` (a script runs), then reads `fired`; the watchdog does the reverse. So one
        # of them sees the other's write, without a lock in every call.
        self.armed = False
        self._fired = False
        self._firing = threading.Lock()

    def __str__(self) -> str:
        return f"stopped after {self.seconds:g} s without returning (script_time_limit)"

    def start(self) -> None:
        self._expired = False
        self._deadline = monotonic() + self.seconds

    def show(self) -> None:
        """Publish the deadline for the other process."""
        if self.seconds:
            _shared[1], _shared[0] = self.label, self._deadline

    def hide(self) -> None:
        """Publish that no script runs."""
        _shared[0] = 0.0

    def exceeded(self) -> bool:
        """Return whether the time since `start` has been used up."""
        return self._expired or (self.seconds > 0 and monotonic() > self._deadline)

    def left(self) -> float:
        """Return the remaining time in s, negative after the deadline; infinite without a limit."""
        return self._deadline - monotonic() if self.seconds > 0 or self._expired else math.inf

    def expire(self) -> None:
        """End the remaining time now."""
        self._expired = True
        self._deadline = monotonic()

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Exclude the time in the context: it is used by the simulator, not by the script."""
        start, armed, is_seen = monotonic(), self.armed, _shared[0] != 0.0
        self.armed = False
        self.hide()
        try:
            yield
        finally:
            self._deadline += monotonic() - start
            self.armed = armed
            # A timer that expired meanwhile was switched off.
            if armed and get_ident() == _MAIN and _timer.limit is self and _timer.next == math.inf:
                _timer.set(max(0.0, self.left()) + _LATER)
            if is_seen:
                self.show()

    def call_outside_with(self, call: Callable[[Callable[[], Any]], Any]) -> None:
        """Set how a script in a thread of its own calls a function in the simulation's thread."""
        self._call_outside = call

    def outside(self, function: Callable[[], Any]) -> Any:
        """Call a function of the simulator, in the simulation's thread; its time does not count."""
        if self._call_outside is not None:
            return self._call_outside(function)
        with self.paused():
            return function()

    def inside(self, function: Callable[[], Any]) -> Any:
        """Call another script, in the simulation's thread; its time counts towards this script's limit."""
        deadline = self._deadline
        try:
            return self.outside(function)
        finally:
            self._deadline = deadline
            if _shared[0]:
                self.show()
            if self.armed and self.seconds and get_ident() == _MAIN:  # the other script has set the timer
                _timer.limit = self
                _timer.set(max(0.0, self.left()) + _LATER)

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a Python function. Raises ScriptStopped if it does not return in time."""
        now = monotonic()
        self._deadline = now + self.seconds
        self.struck = False
        self._thread = get_ident()
        if self.seconds:
            _shared[1], _shared[0] = self.label, self._deadline
        if self._thread != _MAIN:
            _watch(self)
        elif self.seconds:
            _timer.limit = self
            if not now < _timer.next <= self._deadline:  # a timer that should have expired was switched off
                _timer.set(self.seconds)
        try:
            try:
                self.armed = True
                return function(*arguments)
            finally:
                # Restored without calling a Python function, because the script's trace function may hang.
                if self.traces:
                    _set_trace(self.traces[0])
                    _set_profile(self.traces[1])
                    self.traces = None
                self.armed = False
                _shared[0] = 0.0
                if self.struck or self._fired:
                    self._end_strike()
        except ScriptStopped:
            # It may have been raised between the end of the function and the beginning of `finally`.
            self.armed = False
            self.hide()
            self._end_strike()
            raise

    def _end_strike(self) -> None:
        """Discard an exception that has not been raised yet, and restore the trace function."""
        if sys.gettrace() is _let_pass:
            _set_trace(self._traced_by)
        with contextlib.suppress(ScriptStopped):
            _raise_pending()
        while self._fired:
            try:
                with self._firing:
                    self._fired = False
                    _raise_in_thread(self._thread, _NOTHING)
            except ScriptStopped:
                continue

    def fire_if_late(self) -> None:
        """Stop the script if its time has been used up; called by the watchdog."""
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
        """Raise ScriptStopped if the time has been used up, here and in the next line of each frame, such as `finally`.

        Called by the timer's handler; sets the timer again.
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
    """The process's timer, SIGALRM. It is not set in every call, but expires and is set again while scripts run."""

    def __init__(self) -> None:
        self.limit: TimeLimit | None = None  # of the last script that was called in the main thread
        self.next = math.inf  # time at which it expires
        self._is_ready = False

    def set(self, seconds: float) -> None:
        _signal(signal.SIGALRM, _on_alarm)
        if not self._is_ready:
            atexit.register(_setitimer, signal.ITIMER_REAL, 0)  # no handler exists while Python ends
            self._is_ready = True
        self.next = monotonic() + seconds
        # `seconds` may be negative if the process had to wait for the processor.
        _setitimer(signal.ITIMER_REAL, min(max(seconds, _SOONEST), _LONGEST), _RETRY)

    def forget(self) -> None:
        """Mark the timer as not set, because a forked process does not inherit it."""
        self.next = math.inf

    def switch_off(self) -> None:
        self.forget()
        _setitimer(signal.ITIMER_REAL, 0)


_MAIN = threading.main_thread().ident
_timer = _Timer()
os.register_at_fork(after_in_child=_timer.forget)
_watched: weakref.WeakSet[TimeLimit] = weakref.WeakSet()
_watching = threading.Lock()
_watchdog: threading.Thread | None = None


def running() -> TimeLimit | None:
    """Return the limit of the Python script that runs in this thread, the main thread; None if no script runs."""
    limit = _timer.limit
    return limit if limit is not None and limit.armed and limit.seconds and get_ident() == _MAIN else None


def _raise_pending() -> None:
    """Do nothing: at the beginning of the call, Python raises a pending exception."""


def _on_alarm(_number: int, frame: FrameType | None) -> None:
    limit = sys.getrecursionlimit()
    _set_recursion_limit(limit + _ROOM)
    try:
        _setitimer(signal.ITIMER_REAL, 0)  # no further retry
        if _timer.limit is None or not _timer.limit.armed:
            _timer.switch_off()
        else:
            _timer.limit.strike_if_late(frame)
    finally:
        _set_recursion_limit(limit)


def _watch(limit: TimeLimit) -> None:
    """Let the watchdog check a limit as long as it exists; start the watchdog for the first one."""
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
