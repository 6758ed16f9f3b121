"""What a task's plan says happens while its script flies: commands, pushes, displacements, sent by topics."""

from __future__ import annotations

import threading

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from drone_sim.grading.plan import Plan
from drone_sim.ros.grading.sending import Sender, entries_of

_QUEUE = 1000  # messages; every one counts
_STOPPED = "stopped"
_LINGERS = 1.0  # s, for the last messages to go out


class Happenings:
    """Sends the timeline of one plan at a time, some steps late: good enough to watch, not to grade.

    The time is counted in steps, by the stamps of odometry: those of a simulation in real time do not tell it.
    """

    def __init__(self, node: str):
        """Take the simulation's node."""
        self._node = node
        self._prepared: _Played | None = None

    def prepare(self, plan: Plan | None) -> None:
        """Send nothing more of the last plan, and advertise what the next one needs. Raises Unfit."""
        self.end()
        if plan is not None and plan.timeline:
            self._prepared = _Played(plan)

    def begin(self) -> None:
        """Send what has been prepared, from the flight's first step on."""
        if self._prepared is not None:
            self._prepared.listen(self._node)

    def end(self) -> None:
        """Send nothing more."""
        if self._prepared is not None:
            self._prepared.close()
        self._prepared = None


class _Played:
    """A timeline on its way."""

    def __init__(self, plan: Plan):
        """Advertise."""
        parameters = plan.parameters()
        entries = entries_of(plan.timeline_of(parameters), parameters, parameters)
        self._sender = Sender(entries, parameters)
        self._step, self._first = parameters.time_step, parameters.first.name
        self._last = max(one.at for one in entries)
        self._lock = threading.Lock()
        self._listening: list[rospy.Subscriber] = []
        self._stamp, self._steps = rospy.Time(), 0

    def listen(self, node: str) -> None:
        """Follow the flight."""
        with self._lock:
            self._listening = [
                rospy.Subscriber(f"/{self._first}/odom", Odometry, self._on_odometry, queue_size=_QUEUE),
                rospy.Subscriber(f"{node}/state", String, self._on_state, queue_size=1),
            ]

    def close(self) -> None:
        """Send and hear no more; may be called twice."""
        with self._lock:
            for one in self._listening:
                one.unregister()
            self._listening = []
        self._sender.close()

    def _on_odometry(self, message: Odometry) -> None:
        if message.header.stamp == self._stamp:  # it stands still
            return
        self._stamp = message.header.stamp
        self._steps += 1
        self._sender.send(self._steps * self._step)
        if self._steps * self._step > self._last + _LINGERS:
            self.close()

    def _on_state(self, message: String) -> None:
        if message.data == _STOPPED:
            self.close()
