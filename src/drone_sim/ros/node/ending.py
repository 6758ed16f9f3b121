"""How the node ends: the last step first, then the script's cleanup, then rospy's topics, whoever asks for it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable

import rospy
import rospy.core

from drone_sim.ros.node import signals
from drone_sim.run.guardian import Guardian

_PATIENCE = 2.0  # s, of one thread for the other


class Ending:
    """Hears SIGINT, SIGTERM, SIGHUP and `rosnode kill`; the thread that runs the node asks, and says when it is done.

    rospy's own signal handler waits for ever where a signal interrupts what it needs itself: see signals.py. And
    `rosnode kill` closes the topics from another thread, while a step may be publishing on them: here it waits until
    there are no more steps. Where they do not come to an end, the guardian, if there is one, ends the process.
    """

    def __init__(self, guardian: Guardian | None = None, numbers: Iterable[int] = signals.SIGNALS) -> None:
        """Take over the signals; init_node must have been called, with disable_signals.

        Without a guardian `numbers` are those that end the node.
        """
        self._guardian, self._numbers = guardian, tuple(numbers)
        self._asked = False  # no Event: the signal may interrupt who holds its lock
        self._done, self._closed = threading.Event(), threading.Event()
        if guardian is None:
            signals.end_on_signals(self._numbers)
        else:
            guardian.ready(self._ask)
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
        for number in self._numbers if self._guardian is None else ():
            signal.signal(number, signal.SIG_DFL)
        rospy.signal_shutdown("the node ends")  # where another thread does that already, it returns at once
        self._closed.wait(_PATIENCE)

    def _ask(self) -> None:
        self._asked = True

    def _wait_for_the_node(self) -> None:
        if self._guardian is not None:
            self._guardian.count()
        self._ask()
        self._done.wait(_PATIENCE)
