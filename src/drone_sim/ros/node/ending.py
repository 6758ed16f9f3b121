"""How the node ends: the last step first, then the script's cleanup, then rospy's topics, whoever asks for it."""

from __future__ import annotations

import threading

import rospy
import rospy.core

from drone_sim.run.guardian import Guardian

_PATIENCE = 2.0  # s, of one thread for the other


class Ending:
    """Hears SIGINT, SIGTERM, SIGHUP and `rosnode kill`; the thread that runs the node asks, and says when it is done.

    rospy's own signal handler calls the master from within whatever the signal interrupts, and hangs for ever
    where that is a call to the master, too. And `rosnode kill` closes the topics from another thread, while a
    step may be publishing on them: here it waits until there are no more steps. Where they do not come to an
    end, the guardian ends the process.
    """

    def __init__(self, guardian: Guardian) -> None:
        """Take over the signals; init_node must have been called, with disable_signals."""
        self._guardian = guardian
        self._asked, self._done, self._closed = threading.Event(), threading.Event(), threading.Event()
        guardian.ready(self._asked.set)
        rospy.on_shutdown(self._wait_for_the_node)
        rospy.core.add_shutdown_hook(lambda _reason: self._closed.set())  # the last: topics are closed by then

    def asked(self) -> bool:
        """Tell whether it is time to end."""
        return self._asked.is_set()

    def complete(self) -> None:
        """Say that the node has taken its last step and cleaned up; return when rospy has closed its topics."""
        self._done.set()
        rospy.signal_shutdown("the node ends")  # where another thread does that already, it returns at once
        self._closed.wait(_PATIENCE)

    def _wait_for_the_node(self) -> None:
        self._guardian.count()
        self._asked.set()
        self._done.wait(_PATIENCE)
