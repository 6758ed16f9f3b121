"""Watchdog that ends the process after a signal, even if a script, a file or a C call blocks it.

PyBullet's calls, and some calls of scripts, hold the GIL: until they return no Python code runs, neither a signal
handler nor a watchdog thread. The watchdog is therefore a separate process. CPython's C signal handler writes the
signal number into a pipe without taking the GIL; end of file on the pipe means that the process has ended.
Shared memory holds the deadline of the running child script: a script that cannot be stopped ends the process.
"""

from __future__ import annotations

import atexit
import contextlib
import math
import mmap
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import NoReturn

from drone_sim.scripting import time_limit

PATIENCE = 2.5  # s for an orderly exit
_SCRIPT_PATIENCE = 5.0  # s after its deadline in which a script must have stopped
_MARGIN = 0.5  # s by which the process exits itself, with its status, before the watchdog kills it
_MAX_DESCRIPTORS = 2**16
_POLL_PERIOD = 0.5  # s between two checks of scripts
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_HANDLED = 0  # written once the process has handled the signal; its shutdown then has no time limit


class Watchdog:
    """Handler of SIGINT, SIGTERM and SIGHUP, one per process; `asked` is the first signal received, or 0.

    A process that does not end within PATIENCE is killed by SIGKILL, after a line on stderr.
    """

    def __init__(self, name: str):
        """Fork the watchdog. Call this first, in the main thread, before there are threads or much memory to share.

        Until `ready` is called, such as during imports, a signal ends the process at once, without a message.
        `name` begins the line on stderr.
        """
        self.asked = 0
        self._name = name
        self._call: Callable[[], None] = lambda: None
        read_end, self._write = os.pipe()
        parent, scripts = os.getpid(), mmap.mmap(-1, time_limit.WATCHED)
        if os.fork() == 0:
            _run_watchdog(read_end, parent, name, scripts)
        os.close(read_end)
        time_limit.watched_by(scripts)
        os.set_blocking(self._write, False)
        # Under nohup, SIGHUP stays ignored.
        self._signals = [sig for sig in _SIGNALS if sig != signal.SIGHUP or signal.getsignal(sig) != signal.SIG_IGN]
        self._set_handler(signal.SIG_DFL)
        os.register_at_fork(before=self._block, after_in_parent=self._unblock, after_in_child=self._detach)

    def ready(self, call: Callable[[], None] = lambda: None) -> None:
        """Handle signals: each one calls `call`, the first sets `asked`; the process must then end within PATIENCE."""
        self._call = call
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        self._set_handler(self._on_signal)

    def count(self) -> None:
        """Begin the time limit without a signal: the process must end within PATIENCE from now on. Thread-safe."""
        self._send(signal.SIGTERM)

    def stand_down(self) -> None:
        """Cancel the time limit, because the process is ending. Another signal ends it at once."""
        signal.set_wakeup_fd(-1)
        self._set_handler(signal.SIG_DFL)
        self._send(_HANDLED)

    def end(self, status: int) -> NoReturn:
        """Exit with a status within PATIENCE, even if threads or `atexit` functions of a script do not end."""
        _flush()
        self.count()
        timer = threading.Timer(PATIENCE - _MARGIN, self._exit_early, (status,))
        timer.daemon = True
        timer.start()
        # These are sys.exit's first steps. In the rest of Python's shutdown no thread runs, not even the timer's.
        for shutdown_step in (threading._shutdown, atexit._run_exitfuncs):  # type: ignore[attr-defined]
            with contextlib.suppress(Exception):
                shutdown_step()
        self.end_at_once(status)

    @staticmethod
    def end_at_once(status: int) -> NoReturn:
        """Exit with a status after a clean run, without Python's usual shutdown, which takes more than a second."""
        _flush()
        os._exit(status)

    def _exit_early(self, status: int) -> None:
        _report(f"{self._name}: ended without waiting for a thread or atexit function of a script that does not end")
        os._exit(status)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.asked = self.asked or number
        self._call()

    def _set_handler(self, handler: signal._HANDLER) -> None:
        for number in self._signals:
            signal.signal(number, handler)

    def _send(self, number: int) -> None:
        with contextlib.suppress(OSError):  # the watchdog was killed
            os.write(self._write, bytes([number]))

    def _block(self) -> None:
        """Block signals during a fork: a signal to the child must not start the time limit of this process."""
        signal.pthread_sigmask(signal.SIG_BLOCK, self._signals)

    def _unblock(self) -> None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, self._signals)

    def _detach(self) -> None:
        """In a forked child: restore the default signal handlers, and close the pipe to the watchdog."""
        if self._write >= 0:
            signal.set_wakeup_fd(-1)
            self._set_handler(signal.SIG_DFL)
            os.close(self._write)
            self._write = -1
        self._unblock()


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()


def _run_watchdog(read_end: int, process: int, name: str, scripts: mmap.mmap) -> None:
    """Watch `process` from the forked process, kill it if it overruns, and exit."""
    try:
        os.setsid()  # the terminal's Ctrl-C must not reach the watchdog
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        # A script of the same user could write through any other descriptor, such as that of a graded result.
        kept = sorted({2, read_end})
        for before, after in zip((-1, *kept), (*kept, _MAX_DESCRIPTORS)):
            os.closerange(before + 1, after)
        reason = _wait_for_overrun(read_end, _ScriptDeadline(scripts, process))
        if reason:
            _report(f"{name}: killed: {reason}")
            os.kill(process, signal.SIGKILL)
    finally:
        os._exit(0)


class _ScriptDeadline:
    """Detects a child script that runs past its deadline."""

    def __init__(self, memory: mmap.mmap, process: int):
        """Use the shared `memory` into which `process` writes the deadlines."""
        self._memory = memory
        self._stat_file = Path(f"/proc/{process}/stat")
        self._missed_deadline, self._missed_since = 0.0, 0.0  # the deadline found missed, and when (s, monotonic)

    def overdue(self) -> str:
        """Return a message about a script that is late by more than _SCRIPT_PATIENCE, or ''."""
        now = time.monotonic()
        deadline, number = time_limit.overdue(self._memory)
        if not deadline or now < deadline or self._is_suspended():
            self._missed_deadline = 0.0
        elif deadline != self._missed_deadline:
            self._missed_deadline, self._missed_since = deadline, now
        elif now > self._missed_since + _SCRIPT_PATIENCE and time_limit.overdue(self._memory)[0] == deadline:
            return f"{time_limit.text_of(self._memory, number)}, and could not be stopped"
        return ""

    def _is_suspended(self) -> bool:
        """Return whether the process is suspended (SIGSTOP, a debugger)."""
        try:
            return self._stat_file.read_text().rpartition(")")[2].split()[0] in "Tt"
        except (OSError, IndexError):
            return False


def _wait_for_overrun(pipe: int, scripts: _ScriptDeadline) -> str:
    """Wait until the process ends and return '', or return why it must be killed."""
    deadline = math.inf
    while True:
        timeout = max(0.0, min(_POLL_PERIOD, deadline - time.monotonic()))
        if select.select([pipe], [], [], timeout)[0]:
            numbers = os.read(pipe, 64)
            if not numbers:  # every write end is closed: the process has ended
                return ""
            if _HANDLED in numbers:
                deadline = math.inf
            elif deadline == math.inf and any(number in _SIGNALS for number in numbers):
                deadline = time.monotonic() + PATIENCE
        if time.monotonic() >= deadline:
            return f"it did not end within {PATIENCE:g} s: a script, a file or the ROS master kept it busy"
        if overdue := scripts.overdue():
            return overdue


def _report(line: str) -> None:
    with contextlib.suppress(OSError):
        if select.select([], [2], [], 0)[1]:  # stderr may be a full pipe without a reader
            os.write(2, f"{line}\n".encode())
