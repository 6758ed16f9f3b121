"""Where ROS's threads leave work for the thread that owns the simulation."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

_PATIENCE = 30.0  # s; a step, or a scene that is read anew, takes far less


class Inbox:
    """Jobs from any thread, carried out between two steps, in the order in which they came."""

    def __init__(self, patience: float = _PATIENCE) -> None:
        """Start empty; whoever asks waits for `patience` (s)."""
        self._patience = patience
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._came = threading.Event()
        self._sleep: Callable[[float], Any] = self._came.wait
        self._wake: Callable[[], Any] = self._came.set

    def sleep_by(self, sleep: Callable[[float], None], wake: Callable[[], None]) -> None:
        """Let `wait` sleep by another function, which `wake` ends: where others are to be heard meanwhile."""

        def come() -> None:
            self._came.set()
            wake()

        self._sleep, self._wake = sleep, come

    def put(self, job: Callable[[], None]) -> None:
        """Leave a job and go on."""
        self._jobs.put(job)
        self._wake()

    def ask(self, job: Callable[[], str]) -> str:
        """Leave a job, wait until it is done, and return its answer; raises what it raised.

        Raises TimeoutError where the answer does not come in time; a job that has not begun by then never will.
        """
        answer: list[str] = []
        failure: list[Exception] = []
        done = threading.Event()
        begun = threading.Lock()  # taken by what comes first: the job, or the end of patience

        def carry_out() -> None:
            if not begun.acquire(blocking=False):
                return
            try:
                answer.append(job())
            except Exception as error:
                failure.append(error)
            done.set()

        self.put(carry_out)
        if not done.wait(self._patience):
            late = "it will not be carried out" if begun.acquire(blocking=False) else "it is still being carried out"
            raise TimeoutError(f"no answer within {self._patience:g} s: {late}")
        if failure:
            raise failure[0]
        return answer[0]

    def wait(self, seconds: float) -> None:
        """Sleep until a job comes, or for so long."""
        self._sleep(seconds)

    def empty(self) -> None:
        """Carry out all that has come by now. The simulation's thread calls it."""
        if not self._came.is_set():
            return
        self._came.clear()
        for _ in range(self._jobs.qsize()):  # what comes meanwhile waits: a flood must not hold up the step
            self._jobs.get_nowait()()
