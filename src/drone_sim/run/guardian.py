"""Sees to it that a process ends when it is told to, whatever a script, a file or a C call does.

PyBullet's calls, and some of a script's, hold Python's lock: while one of them does not return, no Python code runs,
neither a signal's handler nor a watchdog thread. So a process of its own waits. CPython's handler in C writes the
number of the signal into a pipe, whoever holds the lock; the pipe's end tells that the process has ended.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import time
from collections.abc import Callable
from types import FrameType

PATIENCE = 2.5  # s, for the orderly end
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_NOTICED = 0  # written where the process has seen the signal, and needs time for what is known to end


class Guardian:
    """Catches SIGINT, SIGTERM and SIGHUP; `asked` is the first that came, or 0. One per process.

    A process that does not end within PATIENCE is killed by SIGKILL, after a line on stderr.
    """

    def __init__(self, name: str):
        """Fork the guardian: do it first, while there are neither threads nor much memory to share.

        Until `ready` is called, such as during imports, a signal ends the process at once, and quietly.
        `name` begins the line on stderr. Call it in the main thread.
        """
        self.asked = 0
        self._call: Callable[[], None] = lambda: None
        read, self._write = os.pipe()
        process = os.getpid()
        if os.fork() == 0:
            _be_the_guardian(read, self._write, process, name)
        os.close(read)
        os.set_blocking(self._write, False)
        # What nohup has the process ignore, it goes on to ignore.
        self._signals = [one for one in _SIGNALS if one != signal.SIGHUP or signal.getsignal(one) != signal.SIG_IGN]
        self._handle(signal.SIG_DFL)
        os.register_at_fork(before=self._hold, after_in_parent=self._release, after_in_child=self._let_go)

    def ready(self, call: Callable[[], None] = lambda: None) -> None:
        """From now on a signal sets `asked` and calls `call`; then the process has PATIENCE to end."""
        self._call = call
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        self._handle(self._on_signal)

    def count(self) -> None:
        """Give the process PATIENCE to end although no signal came; any thread may call it."""
        self._tell(signal.SIGTERM)

    def stand_down(self) -> None:
        """Count no longer: the process has noticed, and is on its way. Another signal ends it at once."""
        signal.set_wakeup_fd(-1)
        self._handle(signal.SIG_DFL)
        self._tell(_NOTICED)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.asked = self.asked or number
        self._call()

    def _handle(self, handler: signal._HANDLER) -> None:
        for number in self._signals:
            signal.signal(number, handler)

    def _tell(self, number: int) -> None:
        with contextlib.suppress(OSError):  # somebody has killed the guardian
            os.write(self._write, bytes([number]))

    def _hold(self) -> None:
        """Let signals wait while this thread forks: what is for the fork must not count here."""
        signal.pthread_sigmask(signal.SIG_BLOCK, self._signals)

    def _release(self) -> None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, self._signals)

    def _let_go(self) -> None:
        """In the fork: its signals and its life are its own."""
        if self._write >= 0:
            signal.set_wakeup_fd(-1)
            self._handle(signal.SIG_DFL)
            os.close(self._write)
            self._write = -1
        self._release()


def _be_the_guardian(read: int, write: int, process: int, name: str) -> None:
    """Guard in the forked process, and end with the guarded one."""
    try:
        os.setsid()  # the terminal's Ctrl-C is not for the guardian
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        for unused in (write, 0, 1):
            with contextlib.suppress(OSError):
                os.close(unused)
        if _outlasts_its_time(read):
            _say(
                f"{name}: killed: a script, a file or the ROS master kept it busy for {PATIENCE:g} s when it had to end"
            )
            os.kill(process, signal.SIGKILL)
    finally:
        os._exit(0)


def _outlasts_its_time(pipe: int) -> bool:
    """Wait for a signal's number, then for the end of the process; return whether it has not come in time."""
    deadline: float | None = None
    while True:
        left = None if deadline is None else max(0.0, deadline - time.monotonic())
        if not select.select([pipe], [], [], left)[0]:
            return True
        numbers = os.read(pipe, 64)
        if not numbers:  # the last end that could be written to is closed
            return False
        if _NOTICED in numbers:
            deadline = None
        elif deadline is None and any(number in _SIGNALS for number in numbers):
            deadline = time.monotonic() + PATIENCE


def _say(line: str) -> None:
    with contextlib.suppress(OSError):
        if select.select([], [2], [], 0)[1]:  # nobody may be reading a pipe that is full
            os.write(2, f"{line}\n".encode())
