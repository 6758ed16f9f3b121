"""Where ROS's threads leave work for the thread that owns the simulation."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:  # it imports rospy, which this file does without
    from drone_sim.ros.core.intervention import Intervention

Gate = Callable[[str, Callable[[Any], None]], Callable[[Any], None]]  # of a topic and its callback, its new callback
_Answer = TypeVar("_Answer")
_LOG = logging.getLogger(__name__)
_PATIENCE = 30.0  # s; a step, or a scene that is read anew, takes far less


def open_gate(_topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
    """Let every message of a topic pass."""
    return take


class Inbox:
    """Jobs from any thread, carried out between two steps, in the order in which they came."""

    def __init__(
        self,
        patience: float = _PATIENCE,
        sleep: Callable[[float], Any] | None = None,
        wake: Callable[[], Any] = lambda: None,
        tell: Callable[[Intervention], None] = lambda _: None,
    ):
        """Start empty; whoever asks waits for `patience` (s).

        `wait` calls `sleep`, and a new job calls `wake` to end it: give both if something else must be heard meanwhile.
        `tell` is called before a job that is an intervention.
        """
        self._tell = tell
        self._patience = patience
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._came = threading.Event()
        self._sleep, self._wake = sleep or self._came.wait, wake
        self._executing = 0  # the thread in which `at_once` executes jobs

    def put(self, job: Callable[[], None], intervention: Intervention | None = None) -> None:
        """Leave a job and go on."""
        if threading.get_ident() == self._executing:
            if intervention is not None:
                self._tell(intervention)
            job()
            return
        if intervention is not None:
            self._jobs.put(partial(self._tell, intervention))
        self._jobs.put(job)
        self._came.set()
        self._wake()

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """Execute jobs that the simulation's thread itself leaves in this block at once, and in this block."""
        self._executing = threading.get_ident()
        try:
            yield
        finally:
            self._executing = 0

    def ask(self, job: Callable[[], _Answer], intervention: Intervention | None = None) -> _Answer:
        """Leave a job, wait until it is done, and return its answer; raises what it raised.

        Raises TimeoutError where the answer does not come in time; a job that has not begun by then never will.
        """
        answer: Future[_Answer] = Future()

        def carry_out() -> None:
            if answer.set_running_or_notify_cancel():
                try:
                    answer.set_result(job())
                except Exception as error:
                    answer.set_exception(error)

        self.put(carry_out, intervention)
        if not wait([answer], self._patience).done:
            late = "it will not be executed" if answer.cancel() else "it is still being executed"
            raise TimeoutError(f"no answer within {self._patience:g} s: {late}")
        return answer.result()

    def wait(self, seconds: float) -> None:
        """Sleep until a job comes, or for so long."""
        self._sleep(seconds)

    def empty(self) -> None:
        """Run all jobs that have arrived by now. The simulation's thread calls it.

        A job that raises an exception is logged with its traceback: a message from outside must not end the node.
        """
        if not self._came.is_set():
            return
        self._came.clear()
        for _ in range(self._jobs.qsize()):  # what comes meanwhile waits: a flood must not hold up the step
            try:
                self._jobs.get_nowait()()
            except Exception:
                _LOG.exception("a request could not be executed")
