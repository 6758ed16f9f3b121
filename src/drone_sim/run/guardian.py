"""Sees to it that a process ends when it is told to, whatever a script, a file or a C call does.

PyBullet's calls, and some of a script's, hold Python's lock: while one of them does not return, no Python code runs,
neither a signal's handler nor a watchdog thread. So a process of its own waits. CPython's handler in C writes the
number of the signal into a pipe, whoever holds the lock; the pipe's end tells that the process has ended.
Memory that both have tells when the child script that runs has to return: one that nothing could stop ends the process.
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

PATIENCE = 2.5  # s, for the orderly end
_SCRIPTS_PATIENCE = 5.0  # s, for a script to be stopped after its time
_EARLIER = 0.5  # s, than the guardian, by which a process ends itself, with its status
_MOST_DESCRIPTORS = 2**16
_LOOK = 0.5  # s between two looks at scripts
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
        self._name = name
        self._call: Callable[[], None] = lambda: None
        read, self._write = os.pipe()
        process, scripts = os.getpid(), mmap.mmap(-1, time_limit.WATCHED)
        if os.fork() == 0:
            _be_the_guardian(read, process, name, scripts)
        os.close(read)
        time_limit.watched_by(scripts)
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
        """Stop counting: the process has noticed, and is ending. Another signal ends it at once."""
        signal.set_wakeup_fd(-1)
        self._handle(signal.SIG_DFL)
        self._tell(_NOTICED)

    def end(self, status: int) -> NoReturn:
        """Exit with a status, in PATIENCE at most: a script may have left threads, or functions of `atexit`."""
        _flush()
        self.count()
        timer = threading.Timer(PATIENCE - _EARLIER, self._give_up, (status,))
        timer.daemon = True
        timer.start()
        # What sys.exit does first. While Python takes itself down after that, no thread runs, not even the timer's.
        for wait_for_the_rest in (threading._shutdown, atexit._run_exitfuncs):  # type: ignore[attr-defined]
            with contextlib.suppress(Exception):
                wait_for_the_rest()
        self.end_at_once(status)

    @staticmethod
    def end_at_once(status: int) -> NoReturn:
        """Exit with a status, all being in order, without Python's usual shutdown, which takes more than a second."""
        _flush()
        os._exit(status)

    def _give_up(self, status: int) -> None:
        _say(f"{self._name}: ended without waiting for a thread or atexit function of a script that does not end")
        os._exit(status)

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
        """Block signals while this thread forks: a signal for the fork must not count here."""
        signal.pthread_sigmask(signal.SIG_BLOCK, self._signals)

    def _release(self) -> None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, self._signals)

    def _let_go(self) -> None:
        """In the fork: handle signals as usual, and be guarded no longer."""
        if self._write >= 0:
            signal.set_wakeup_fd(-1)
            self._handle(signal.SIG_DFL)
            os.close(self._write)
            self._write = -1
        self._release()


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()


def _be_the_guardian(read: int, process: int, name: str, scripts: mmap.mmap) -> None:
    """Guard in the forked process, and end with the guarded one."""
    try:
        os.setsid()  # the terminal's Ctrl-C is not for the guardian
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        # A script of the same user could write through any other descriptor, such as that of a graded result.
        kept = sorted({2, read})
        for before, after in zip((-1, *kept), (*kept, _MOST_DESCRIPTORS)):
            os.closerange(before + 1, after)
        why = _outlasts_its_time(read, _Scripts(scripts, process))
        if why:
            _say(f"{name}: killed: {why}")
            os.kill(process, signal.SIGKILL)
    finally:
        os._exit(0)


class _Scripts:
    """Looks whether a script goes on and on."""

    def __init__(self, memory: mmap.mmap, process: int):
        """Take the memory that the process writes into."""
        self._memory = memory
        self._state = Path(f"/proc/{process}/stat")
        self._late, self._since = 0.0, 0.0  # the last deadline that had passed, and since when that is seen

    def overdue(self) -> str:
        """Return what to say of a script that has had its time and more, or ''."""
        now = time.monotonic()
        deadline, number = time_limit.overdue(self._memory)
        if not deadline or now < deadline or self._is_halted():
            self._late = 0.0
        elif deadline != self._late:
            self._late, self._since = deadline, now
        elif now > self._since + _SCRIPTS_PATIENCE and time_limit.overdue(self._memory)[0] == deadline:
            return f"{time_limit.text_of(self._memory, number)}, and could not be stopped"
        return ""

    def _is_halted(self) -> bool:
        """Tell whether somebody has stopped the process (SIGSTOP, a debugger)."""
        try:
            return self._state.read_text().rpartition(")")[2].split()[0] in "Tt"
        except (OSError, IndexError):
            return False


def _outlasts_its_time(pipe: int, scripts: _Scripts) -> str:
    """Wait for a signal's number, then for the end of the process; return why it has to be ended, or ''."""
    deadline = math.inf
    while True:
        left = max(0.0, min(_LOOK, deadline - time.monotonic()))
        if select.select([pipe], [], [], left)[0]:
            numbers = os.read(pipe, 64)
            if not numbers:  # the last end that could be written to is closed
                return ""
            if _NOTICED in numbers:
                deadline = math.inf
            elif deadline == math.inf and any(number in _SIGNALS for number in numbers):
                deadline = time.monotonic() + PATIENCE
        if time.monotonic() >= deadline:
            return f"it did not end within {PATIENCE:g} s: a script, a file or the ROS master kept it busy"
        if overdue := scripts.overdue():
            return overdue


def _say(line: str) -> None:
    with contextlib.suppress(OSError):
        if select.select([], [2], [], 0)[1]:  # nobody may be reading a pipe that is full
            os.write(2, f"{line}\n".encode())
