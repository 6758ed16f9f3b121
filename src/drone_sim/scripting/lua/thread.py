"""Runs all calls into Lua, usually in a thread of its own for each Lua state.

Lua does not hold Python's lock while it runs, so the simulation's thread can wait for it, with a limit. A hook
inside Lua stops loops in Lua code. A loop in C code, such as string.find with a very slow pattern, cannot be stopped
within a process: then the thread is left behind with its state, and if it ever goes on, it finds the API closed.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable
from types import CodeType
from typing import Any

from drone_sim.scripting.time_limit import ScriptStopped, TimeLimit

_GRACE = 0.25  # s of the thread's own CPU time beyond the time limit, for what the hook ends
_PATIENCE = 10.0  # s beyond the time limit, however little time a busy machine gives the thread
_LOOK = 0.01  # s between two looks at what is late
_OUTSTAY = 5.0  # s that such a function may go on
_NICE = 19  # the priority of what is left behind: it gets the time that nobody else wants
MOST_LEFT = 8  # threads of a process that may hang at once

_left: list[threading.Thread] = []


class LeftBehind(ScriptStopped):
    """The script hangs in C: its thread is left alone, and nothing can be called in it any more."""


def left_behind() -> int:
    """Return how many threads of this process hang in Lua."""
    _left[:] = [thread for thread in _left if thread.is_alive()]
    return len(_left)


class SameThread:
    """Runs functions in the caller's thread: for scripts that have nothing which loops in C."""

    def __init__(self, limit: TimeLimit):
        """Take the limit, which the hook looks at."""
        self.closed = False
        self.api_code: CodeType | None = None
        self._limit = limit

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function; raises what it raises."""
        self._limit.start()
        self._limit.show()
        try:
            return function(*arguments)
        finally:
            self._limit.hide()

    def close(self) -> None:
        """Close the API."""
        self.closed = True


class LuaThread:
    """Runs functions in a thread of its own while the caller waits: never both at once.

    What runs there may have something done by the caller in between, such as OpenGL (`TimeLimit.outside`).
    """

    def __init__(self, limit: TimeLimit):
        """Start the thread, whose functions may run as long as `limit` says; it ends with `close`."""
        self.closed = False  # once it is, no function of the API does anything
        self.api_code: CodeType | None = None  # of the function that answers Lua's calls
        self._limit = limit
        self._seconds = min(limit.seconds or threading.TIMEOUT_MAX, threading.TIMEOUT_MAX)
        limit.carry_with(self._carry)
        self._go, self._done = threading.Lock(), threading.Lock()
        self._go.acquire()
        self._done.acquire()
        self._job: tuple[Callable[..., Any], tuple[Any, ...]] | None = None
        self._errand: Callable[[], Any] | None = None
        self._outcome: tuple[Any, BaseException | None] = (None, None)
        self._thread = threading.Thread(target=self._work, name="Lua script", daemon=True)
        self._thread.start()

    # ---- in the simulation's thread

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function in the thread; raises what it raises, and LeftBehind where it does not come back."""
        if self.closed:
            raise LeftBehind
        self._job = (function, arguments)
        self._limit.start()
        try:
            self._go.release()
            came = self._done.acquire(timeout=self._seconds)
            if not came or self._errand is not None:
                self._wait(came)
        except BaseException:  # LeftBehind, or what a signal's handler raised
            self._end()
            raise
        return self._take_outcome()

    def close(self) -> None:
        """Let the thread end; one that is left behind is not touched."""
        if not self.closed:
            self.closed = True
            self._job = None
            self._go.release()

    def _wait(self, called: bool = False) -> None:
        """Wait for the function to end, after an errand if it called for one; raises LeftBehind where it hangs."""
        if called:
            self._do_errand()
        while not self._is_back(min(max(_LOOK, self._limit.left()), threading.TIMEOUT_MAX)):
            if self._limit.exceeded():
                self._wait_beyond(self._cpu_time() + _GRACE)
                return

    def _wait_beyond(self, last: float) -> None:
        while not self._is_back(_LOOK):
            if self._cpu_time() > last or self._limit.left() < -_PATIENCE:
                self._leave()

    def _cpu_time(self) -> float:
        """Return the CPU time (s) that the thread has used; 0 where that is not known."""
        try:
            return time.clock_gettime(time.pthread_getcpuclockid(self._thread.ident or 0))
        except (AttributeError, OSError):
            return 0.0

    def _is_back(self, timeout: float) -> bool:
        """Wait, and tell whether the function has ended; if it asks for an errand instead, do that."""
        if not self._done.acquire(timeout=timeout):
            return False
        if self._errand is None:
            return True
        self._do_errand()
        return False

    def _do_errand(self) -> None:
        errand, self._errand = self._errand, None
        try:
            if self.closed or errand is None:
                raise LeftBehind
            with self._limit.paused():
                self._outcome = (errand(), None)
        except BaseException as error:
            self._outcome = (None, error)
            if not isinstance(error, (Exception, LeftBehind)):
                raise
        finally:
            self._go.release()

    def _end(self) -> None:
        """Stop what runs, or leave it behind."""
        if not self.closed:
            self._limit.expire()
            try:
                self._wait()
            except BaseException:
                self.closed = True
        self._outcome = (None, None)

    def _leave(self) -> None:
        """Close the API, and leave the thread behind as soon as it is in none of its functions."""
        self.closed = True
        end = time.monotonic() + _OUTSTAY
        while self._is_in_api() and time.monotonic() < end:
            if self._is_back(_LOOK):
                self._go.release()
                break
        else:
            _left.append(self._thread)
            with contextlib.suppress(OSError, TypeError):
                os.setpriority(os.PRIO_PROCESS, self._thread.native_id, _NICE)  # type: ignore[arg-type]
        raise LeftBehind

    def _is_in_api(self) -> bool:
        """Tell whether Lua is in a function of the API: looked up, since a note of it would cost every call."""
        frame = sys._current_frames().get(self._thread.ident or 0)
        while frame is not None and frame.f_code is not self.api_code:
            frame = frame.f_back
        return frame is not None

    # ---- in the thread

    def _work(self) -> None:
        while True:
            self._go.acquire()
            job, self._job = self._job, None
            if job is None:
                return
            try:
                self._outcome = (job[0](*job[1]), None)
            except BaseException as error:
                self._outcome = (None, error)
            del job
            self._done.release()
            if self.closed:
                return

    def _carry(self, function: Callable[[], Any]) -> Any:
        """Have a function called in the simulation's thread, which waits."""
        self._errand = function
        self._done.release()
        self._go.acquire()
        return self._take_outcome()

    def _take_outcome(self) -> Any:
        (value, error), self._outcome = self._outcome, (None, None)
        if error is not None:
            raise error
        return value


Executor = LuaThread | SameThread
