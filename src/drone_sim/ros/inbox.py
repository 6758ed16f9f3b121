"""Where ROS's threads leave work for the thread that owns the simulation."""

from __future__ import annotations

import threading
from queue import Empty, SimpleQueue
from typing import Callable, List

_PATIENCE = 30.0  # s; a step, or a scene that is read anew, takes far less


class Inbox:
    """Jobs from any thread, carried out between two steps, in the order in which they came."""

    def __init__(self) -> None:
        """Start empty."""
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._came = threading.Event()

    def put(self, job: Callable[[], None]) -> None:
        """Leave a job and go on."""
        self._jobs.put(job)
        self._came.set()

    def ask(self, job: Callable[[], str]) -> str:
        """Leave a job, wait until it is done, and return its answer; raises what it raised, or TimeoutError."""
        answer: List[str] = []
        failure: List[Exception] = []
        done = threading.Event()

        def carry_out() -> None:
            try:
                answer.append(job())
            except Exception as error:
                failure.append(error)
            done.set()

        self.put(carry_out)
        if not done.wait(_PATIENCE):
            raise TimeoutError(f"no answer within {_PATIENCE:.0f} s")
        if failure:
            raise failure[0]
        return answer[0]

    def wait(self, seconds: float) -> None:
        """Sleep until a job comes, or for so long."""
        self._came.wait(seconds)

    def empty(self) -> bool:
        """Carry out all that has come; return whether there was anything. The simulation's thread calls it."""
        if not self._came.is_set():
            return False
        self._came.clear()
        found = False
        while True:
            try:
                job = self._jobs.get_nowait()
            except Empty:
                return found
            job()
            found = True
