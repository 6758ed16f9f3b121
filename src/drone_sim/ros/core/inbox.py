"""Queue of jobs from ROS's threads to the thread that owns the simulation. ROS is not needed."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from functools import partial
from queue import SimpleQueue
from typing import Any, NamedTuple, TypeVar

Gate = Callable[[str, Callable[[Any], None]], Callable[[Any], None]]  # wraps the callback of a topic
_Result = TypeVar("_Result")
_LOG = logging.getLogger(__name__)
_TIMEOUT = 30.0  # s; a step, or loading a scene again, takes far less


class Intervention(NamedTuple):
    """Change of the world from outside: its kind (grading/permissions.py), target, topic or service, and sender."""

    action: str
    what: str
    way: str
    by: str


def open_gate(_topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
    """Return the callback itself: no message waits."""
    return take


class Inbox:
    """Jobs from any thread, which run between two steps, in the order of their arrival."""

    def __init__(
        self,
        timeout: float = _TIMEOUT,
        sleep: Callable[[float], Any] | None = None,
        wake: Callable[[], Any] = lambda: None,
        on_intervention: Callable[[Intervention], None] = lambda _: None,
    ):
        """Create an empty queue; `ask` waits for at most `timeout` (s).

        `wait` calls `sleep`, and a new job calls `wake` to end it: give both to wait for something else at the same
        time. `on_intervention` is called before each job that is an intervention.
        """
        self._on_intervention = on_intervention
        self._timeout = timeout
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._has_jobs = threading.Event()
        self.wait = sleep or self._has_jobs.wait  # sleeps until a job arrives, for at most a time (s)
        self._wake = wake
        self._direct_thread = 0  # id of the thread in `run_directly`

    def put(self, job: Callable[[], None], intervention: Intervention | None = None) -> None:
        """Add a job, and return at once."""
        if threading.get_ident() == self._direct_thread:
            if intervention is not None:
                self._on_intervention(intervention)
            job()
            return
        if intervention is not None:
            self._jobs.put(partial(self._on_intervention, intervention))
        self._jobs.put(job)
        self._has_jobs.set()
        self._wake()

    @contextlib.contextmanager
    def run_directly(self) -> Iterator[None]:
        """In this block, run jobs that the present thread puts immediately. Only the simulation's thread calls this."""
        self._direct_thread = threading.get_ident()
        try:
            yield
        finally:
            self._direct_thread = 0

    def ask(self, job: Callable[[], _Result], intervention: Intervention | None = None) -> _Result:
        """Add a job, wait until it has run, and return its result. Raises what the job raises.

        Raises TimeoutError if there is no result in time; a job that has not begun by then will not run.
        """
        result: Future[_Result] = Future()

        def run() -> None:
            if result.set_running_or_notify_cancel():
                try:
                    result.set_result(job())
                except Exception as error:
                    result.set_exception(error)

        self.put(run, intervention)
        if not wait([result], self._timeout).done:
            state = "it will not be executed" if result.cancel() else "it is still being executed"
            raise TimeoutError(f"no answer within {self._timeout:g} s: {state}")
        return result.result()

    def run_jobs(self) -> None:
        """Run all jobs that have arrived by now. Only the simulation's thread calls this.

        If a job raises an exception, its traceback is logged: a message from outside must not end the node.
        """
        if not self._has_jobs.is_set():
            return
        self._has_jobs.clear()
        for _ in range(self._jobs.qsize()):  # jobs that arrive meanwhile wait, so a flood of them cannot block the step
            try:
                self._jobs.get_nowait()()
            except Exception:
                _LOG.exception("a request could not be executed")
