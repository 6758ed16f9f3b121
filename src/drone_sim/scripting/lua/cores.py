"""Lets two threads that take turns share a core.

Otherwise the one that is woken is sent to an idle core, which first has to wake up itself: in a virtual machine that
takes 50 us, five times as long as the rest of the turn.
"""

from __future__ import annotations

import contextlib
import ctypes
import os


class Cores:
    """The cores of the calling thread, and of one other thread that it waits for; nothing where there is one core."""

    def __init__(self, other: int):
        """Take the kernel's id of the other thread; the calling thread's cores are what both may use."""
        self._other = other
        self._shared = -1  # the core that the other thread is kept on
        self._are_shared = False
        try:
            self._all: set[int] = os.sched_getaffinity(0)
            self._here = ctypes.CDLL(None).sched_getcpu
        except (AttributeError, OSError):  # not Linux
            self._all = set()

    def share(self) -> None:
        """Keep both threads on the core that the calling thread is on."""
        if len(self._all) < 2:
            return
        core = self._here()
        if core != self._shared:
            self._allow(self._other, {core})
            self._shared = core
        self._are_shared = self._allow(0, {core})

    def part(self) -> None:
        """Let the calling thread go wherever it could."""
        if self._are_shared:
            self._are_shared = False
            self._allow(0, self._all)

    def free(self) -> None:
        """Let the other thread go wherever it could, too."""
        self.part()
        self._allow(self._other, self._all)

    @staticmethod
    def _allow(thread: int, cores: set[int]) -> bool:
        with contextlib.suppress(OSError, ValueError):
            os.sched_setaffinity(thread, cores)
            return True
        return False
