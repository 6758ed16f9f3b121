"""Stops a runaway script.

A Python script runs in the simulation's own thread, so another thread has to raise an exception in it;
a Lua script asks `exceeded` from a hook that counts instructions.
"""

from __future__ import annotations

import contextlib
import ctypes
import threading
import time
import weakref
from typing import Any, Callable, Iterator, Optional

_POLL = 0.05  # s between two looks of the watchdog
_AGAIN = 0.25  # s after which a script that swallowed the exception gets another

_raise_in_thread = ctypes.pythonapi.PyThreadState_SetAsyncExc
_raise_in_thread.argtypes = (ctypes.c_ulong, ctypes.py_object)
_NOTHING = ctypes.py_object()  # NULL


class Stopped(BaseException):
    """Raised in a script that ran for too long; no Exception, so that `except Exception` lets it pass."""


class TimeLimit:
    """How long a script may run before it has to return; one script at a time."""

    def __init__(self, seconds: float):
        """Take the limit in seconds of real time; 0 means none."""
        self.seconds = seconds
        self._deadline = 0.0
        self._thread = 0
        # The script's thread writes `armed` and then reads `fired`, the watchdog the other way round: so one
        # of the two sees the other, without a lock in every call.
        self._armed = False
        self._fired = False
        self._firing = threading.Lock()

    def __str__(self) -> str:
        """Say what was exceeded."""
        return f"stopped after {self.seconds:g} s without returning (script_time_limit)"

    def start(self) -> None:
        """Begin to count."""
        self._deadline = time.monotonic() + self.seconds

    def exceeded(self) -> bool:
        """Tell whether the time since `start` is used up."""
        return self.seconds > 0 and time.monotonic() > self._deadline

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Do not count what happens inside: it is the simulator's time, not the script's."""
        began, armed = time.monotonic(), self._armed
        self._armed = False
        try:
            yield
        finally:
            self._deadline += time.monotonic() - began
            self._armed = armed

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a Python function; raises Stopped where it does not return in time."""
        if not self._thread:
            _watch(self)
        self._thread = threading.get_ident()
        self._deadline = time.monotonic() + self.seconds
        try:
            try:
                self._armed = True
                return function(*arguments)
            finally:
                self._armed = False
                if self._fired:
                    self._take_back()
        except Stopped:
            # It may have struck between the end of the function and the beginning of `finally`.
            self._armed = False
            self._take_back()
            raise

    def _take_back(self) -> None:
        """Drop an exception that is still on its way."""
        while True:
            try:
                with self._firing:
                    self._fired = False
                    _raise_in_thread(self._thread, _NOTHING)
                return
            except Stopped:
                continue

    def fire_if_late(self) -> None:
        """Raise Stopped in the script's thread; the watchdog calls it."""
        if not (self._armed and self.exceeded()):
            return
        with self._firing:
            self._fired = True
            if self._armed and self.exceeded():
                self._deadline = time.monotonic() + _AGAIN
                _raise_in_thread(self._thread, Stopped)
            else:
                self._fired = False


_watched: weakref.WeakSet[TimeLimit] = weakref.WeakSet()
_watching = threading.Lock()
_watchdog: Optional[threading.Thread] = None


def _watch(limit: TimeLimit) -> None:
    """Let the watchdog, which starts with the first one, look after a limit for as long as it exists."""
    global _watchdog
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
