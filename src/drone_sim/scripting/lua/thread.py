"""Execution of calls into Lua, usually in a separate thread for each Lua state.

Lua does not hold Python's lock while it runs, so the simulation's thread can wait for it with a time limit. A hook in
Lua stops loops in Lua code. A loop in C code, such as string.find with a very slow pattern, cannot be stopped within a
process: then the thread is abandoned with its state, and the API is closed for it in case it ever continues.
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

_GRACE = 0.25  # s of the thread's own CPU time beyond the time limit, in which the hook can stop it
_PATIENCE = 10.0  # s of real time beyond the time limit, for a thread that gets little CPU time
_POLL = 0.01  # s between checks of a late thread
_API_TIMEOUT = 5.0  # s that an API function may continue in an abandoned thread
_NICE = 19  # lowest priority, for abandoned threads
MOST_ABANDONED = 8  # threads of a process that may hang at once

_abandoned: list[threading.Thread] = []


class Abandoned(ScriptStopped):
    """The script hangs in C code: its thread is abandoned, and the script cannot be called any more."""


def count_abandoned() -> int:
    """Return how many threads of this process hang in Lua."""
    _abandoned[:] = [thread for thread in _abandoned if thread.is_alive()]
    return len(_abandoned)


class SameThread:
    """Runs functions in the caller's thread, for scripts without functions that may loop in C code."""

    def __init__(self, limit: TimeLimit):
        """`limit` is checked by Lua's hook."""
        self.closed = False
        self.api_code: CodeType | None = None
        self._limit = limit

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function. Raises its exceptions."""
        self._limit.start()
        self._limit.show()
        try:
            return function(*arguments)
        finally:
            self._limit.hide()

    def close(self) -> None:
        self.closed = True


class LuaThread:
    """Runs functions in a separate thread while the caller waits; the two never run at the same time.

    A function there may let the caller's thread run another one, for example with OpenGL (`TimeLimit.outside`).
    """

    def __init__(self, limit: TimeLimit):
        """Start the thread, which `close` ends; `limit` is the time limit of each function."""
        self.closed = False  # if set, API functions do nothing
        self.api_code: CodeType | None = None  # code of the function that Lua calls for any API function
        self._limit = limit
        self._seconds = min(limit.seconds or threading.TIMEOUT_MAX, threading.TIMEOUT_MAX)
        limit.call_outside_with(self._call_outside)
        self._go, self._done = threading.Lock(), threading.Lock()
        self._go.acquire()
        self._done.acquire()
        self._job: tuple[Callable[..., Any], tuple[Any, ...]] | None = None
        self._request: Callable[[], Any] | None = None  # a function for the caller's thread
        self._outcome: tuple[Any, BaseException | None] = (None, None)
        self._thread = threading.Thread(target=self._work, name="Lua script", daemon=True)
        self._thread.start()

    # ---- in the simulation's thread

    def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function in the thread. Raises its exceptions, and Abandoned if it hangs."""
        if self.closed:
            raise Abandoned
        self._job = (function, arguments)
        self._limit.start()
        try:
            self._go.release()
            in_time = self._done.acquire(timeout=self._seconds)
            if not in_time or self._request is not None:
                self._wait(in_time)
        except BaseException:  # Abandoned, or an exception of a signal handler
            self._end()
            raise
        return self._take_outcome()

    def close(self) -> None:
        """End the thread; an abandoned one is not changed."""
        if not self.closed:
            self.closed = True
            self._job = None
            self._go.release()

    def _wait(self, has_request: bool = False) -> None:
        """Wait until the function has ended, and execute its requests. Raises Abandoned if it hangs."""
        if has_request:
            self._execute_request()
        while not self._has_ended(min(max(_POLL, self._limit.left()), threading.TIMEOUT_MAX)):
            if self._limit.exceeded():
                last = self._cpu_time() + _GRACE
                while not self._has_ended(_POLL):
                    if self._cpu_time() > last or self._limit.left() < -_PATIENCE:
                        self._abandon()
                return

    def _cpu_time(self) -> float:
        """Return the CPU time (s) of the thread; 0 if it is unknown."""
        try:
            return time.clock_gettime(time.pthread_getcpuclockid(self._thread.ident or 0))
        except (AttributeError, OSError):
            return 0.0

    def _has_ended(self, timeout: float) -> bool:
        """Wait; return whether the function has ended. Execute its request, if it has sent one."""
        if not self._done.acquire(timeout=timeout):
            return False
        if self._request is None:
            return True
        self._execute_request()
        return False

    def _execute_request(self) -> None:
        request, self._request = self._request, None
        try:
            if self.closed or request is None:
                raise Abandoned
            with self._limit.paused():
                self._outcome = (request(), None)
        except BaseException as error:
            self._outcome = (None, error)
            if not isinstance(error, (Exception, Abandoned)):
                raise
        finally:
            self._go.release()

    def _end(self) -> None:
        """Stop the running function, or abandon the thread."""
        if not self.closed:
            self._limit.expire()
            try:
                self._wait()
            except BaseException:
                self.closed = True
        self._outcome = (None, None)

    def _abandon(self) -> None:
        """Close the API, and abandon the thread as soon as it runs none of the API's functions."""
        self.closed = True
        end = time.monotonic() + _API_TIMEOUT
        while self._is_in_api() and time.monotonic() < end:
            if self._has_ended(_POLL):
                self._go.release()
                break
        else:
            _abandoned.append(self._thread)
            with contextlib.suppress(OSError, TypeError):
                os.setpriority(os.PRIO_PROCESS, self._thread.native_id, _NICE)  # type: ignore[arg-type]
        raise Abandoned

    def _is_in_api(self) -> bool:
        """Return whether Lua runs a function of the API, by the stack, because a flag would slow every call down."""
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

    def _call_outside(self, function: Callable[[], Any]) -> Any:
        """Call a function in the simulation's thread, which waits for this one."""
        self._request = function
        self._done.release()
        self._go.acquire()
        return self._take_outcome()

    def _take_outcome(self) -> Any:
        (value, error), self._outcome = self._outcome, (None, None)
        if error is not None:
            raise error
        return value


Executor = LuaThread | SameThread
