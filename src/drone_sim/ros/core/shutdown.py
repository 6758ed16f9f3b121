"""The end of a node after a signal or `rosnode kill`: last step, then the script's cleanup, then rospy's topics."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable
from typing import Any

import rospy
import rospy.core

from drone_sim.ros.core.startup import init_node, status_of_node
from drone_sim.run.watchdog import Watchdog

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_TIMEOUT = 2.0  # s, for which one thread waits for the other


class Shutdown:
    """Handler of SIGINT, SIGTERM, SIGHUP and `rosnode kill`, for the thread that runs the node.

    rospy's own signal handler can deadlock: see end_on_signals. And `rosnode kill` closes the topics in another
    thread, while a step may be publishing: this class delays that until the last step. If the steps do not end, the
    watchdog, if there is one, ends the process.
    """

    def __init__(self, watchdog: Watchdog | None = None, numbers: Iterable[int] = SIGNALS) -> None:
        """Install the handlers, after init_node with disable_signals. Without a watchdog, handle signals `numbers`."""
        self._watchdog, self._numbers = watchdog, tuple(numbers)
        self._is_requested = False  # no Event: a signal handler may interrupt code that holds the Event's lock
        self._done, self._closed = threading.Event(), threading.Event()
        if watchdog is None:
            end_on_signals(self._numbers)
        else:
            watchdog.ready(self._request)
        rospy.on_shutdown(self._wait_for_last_step)
        rospy.core.add_shutdown_hook(lambda _reason: self._closed.set())  # this hook runs last, after topics are closed

    def is_requested(self) -> bool:
        return self._is_requested or bool(rospy.is_shutdown())

    def complete(self) -> None:
        """Shut rospy down after the node's last step and cleanup; return when its topics are closed.

        Another signal ends the process at once, because the master may not answer.
        """
        self._done.set()
        for number in self._numbers if self._watchdog is None else ():
            signal.signal(number, signal.SIG_DFL)
        rospy.signal_shutdown("the node ends")  # returns at once if another thread is doing this already
        self._closed.wait(_TIMEOUT)

    def _request(self) -> None:
        self._is_requested = True

    def _wait_for_last_step(self) -> None:
        if self._watchdog is not None:
            self._watchdog.count()
        self._request()
        self._done.wait(_TIMEOUT)


def run_tool(name: str, run: Callable[[Callable[[], bool]], Any], signals: Iterable[int] = SIGNALS) -> int:
    """Run an interactive tool as a node; return its exit status. `run` gets a function that says whether to end.

    rospy's own handlers would close the topics before the last message is sent. The tool runs in real time: its user
    must be able to stop the drone even while /clock stands still.
    """
    if not init_node(name, anonymous=True, disable_signals=True, disable_rostime=True):
        return 1
    shutdown = Shutdown(numbers=signals)
    status = status_of_node(name, lambda: run(shutdown.is_requested))
    shutdown.complete()
    return status


def end_on_signals(signals: Iterable[int] = SIGNALS) -> None:
    """Shut the node down on a signal. Call this in the main thread, after init_node with disable_signals.

    rospy's own handler runs inside the code that the signal interrupts, and deadlocks if that code holds a lock that it
    needs: of a message that is being written, of the log, of a call to the master. Here CPython's handler in C writes
    to a pipe, and a thread that reads from it shuts the node down. SIGHUP stays ignored under nohup.
    """
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    for number in signals:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda *_: None)  # CPython writes to the pipe only for signals that have a handler
    signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    numbers = set(signals)

    def wait() -> None:
        while not numbers.intersection(os.read(read_end, 64)):
            pass
        # Not a daemon thread: the process must not end before the node is unregistered from the master.
        threading.Thread(target=rospy.signal_shutdown, args=("signal",), name="end").start()

    threading.Thread(target=wait, name="signals", daemon=True).start()
