"""How the node ends: the last step first, then the script's cleanup, then rospy's topics, whoever asks for it."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable
from typing import Any

import rospy
import rospy.core

from drone_sim.ros.core.startup import init_node, reported
from drone_sim.run.watchdog import Watchdog

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_PATIENCE = 2.0  # s, of one thread for the other


class Shutdown:
    """Hears SIGINT, SIGTERM, SIGHUP and `rosnode kill`; the thread that runs the node asks, and says when it is done.

    rospy's own signal handler waits for ever if a signal interrupts code that holds a lock it needs: see
    end_on_signals. And `rosnode kill` closes the topics from another thread, while a step may be publishing on them:
    here it waits until there are no more steps. If the steps do not end, the watchdog, if there is one, ends the
    process.
    """

    def __init__(self, watchdog: Watchdog | None = None, numbers: Iterable[int] = SIGNALS) -> None:
        """Take over the signals; init_node must have been called, with disable_signals.

        Without a watchdog `numbers` are those that end the node.
        """
        self._watchdog, self._numbers = watchdog, tuple(numbers)
        self._asked = False  # no Event: the signal may interrupt who holds its lock
        self._done, self._closed = threading.Event(), threading.Event()
        if watchdog is None:
            end_on_signals(self._numbers)
        else:
            watchdog.ready(self._ask)
        rospy.on_shutdown(self._wait_for_the_node)
        rospy.core.add_shutdown_hook(lambda _reason: self._closed.set())  # the last: topics are closed by then

    def asked(self) -> bool:
        """Tell whether it is time to end."""
        return self._asked or bool(rospy.is_shutdown())

    def complete(self) -> None:
        """Say that the node has taken its last step and cleaned up; return when rospy has closed its topics.

        Another signal ends it at once, where the master does not answer.
        """
        self._done.set()
        for number in self._numbers if self._watchdog is None else ():
            signal.signal(number, signal.SIG_DFL)
        rospy.signal_shutdown("the node ends")  # where another thread does that already, it returns at once
        self._closed.wait(_PATIENCE)

    def _ask(self) -> None:
        self._asked = True

    def _wait_for_the_node(self) -> None:
        if self._watchdog is not None:
            self._watchdog.count()
        self._ask()
        self._done.wait(_PATIENCE)


def run_tool(name: str, run: Callable[[Callable[[], bool]], Any], signals: Iterable[int] = SIGNALS) -> int:
    """Run an interactive tool as a node; return its exit status. `run` gets a function that tells when to end.

    rospy's own handlers would close the topics before the last message is sent. The tool runs in real time: its user
    must be able to stop the drone even while /clock stands still.
    """
    if not init_node(name, anonymous=True, disable_signals=True, disable_rostime=True):
        return 1
    shutdown = Shutdown(numbers=signals)
    status = reported(name, lambda: run(shutdown.asked))
    shutdown.complete()
    return status


def end_on_signals(signals: Iterable[int] = SIGNALS) -> None:
    """Have a signal shut the node down; call it in the main thread, after init_node with disable_signals.

    rospy's own handler runs inside the code that the signal interrupts, and waits for ever for a lock that this code
    holds: of a message that is being written, of the log, of a call to the master. Here CPython's handler in C writes
    to a pipe, and a thread that reads from it shuts the node down. SIGHUP stays ignored under nohup.
    """
    read, write = os.pipe()
    os.set_blocking(write, False)
    for number in signals:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _do_nothing)
    signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    threading.Thread(target=_wait, args=(read, set(signals)), name="signals", daemon=True).start()


def _do_nothing(*_: object) -> None:
    """Do nothing: CPython writes to the pipe only for signals that have a handler."""


def _wait(pipe: int, signals: set[int]) -> None:
    while not signals.intersection(os.read(pipe, 64)):
        pass
    # Not a daemon: the process does not end before the master knows.
    threading.Thread(target=rospy.signal_shutdown, args=("signal",), name="end").start()
