"""/diagnostics: once a second of real time, while somebody listens."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater

from drone_sim.ros.node.inbox import Inbox
from drone_sim.run.diagnosis.finding import ERROR, Finding

PERIOD = 1.0  # s of real time
PATIENCE = 2.0  # s, for the simulation's answer
_LONGEST = 600  # characters of a value
_BUSY = "simulation"  # the finding that says that there is no answer


class Diagnostics(threading.Thread):
    """Asks the simulation's thread for what it finds, between two steps, and publishes it; a daemon thread.

    While nobody listens the steps know nothing of it. The updater's own `update` is not used: it asks the master for
    its period, and fails where that has gone.
    """

    def __init__(self, look: Callable[[], list[Finding]], stamp: Callable[[], rospy.Time], inbox: Inbox):
        """Advertise. `look` and `stamp` are called in the simulation's thread."""
        super().__init__(name="diagnostics", daemon=True)
        self._look, self._stamp, self._inbox = look, stamp, inbox
        self._ended = threading.Event()
        self._findings: dict[str, Finding] = {}
        self._answered = threading.Event()
        self._answered.set()
        self._asked = 0.0  # s, of the monotonic clock
        self._updater = _Updater()
        rospy.on_shutdown(self.close)

    def close(self) -> None:
        """Publish no more; may be called twice."""
        self._ended.set()

    def run(self) -> None:
        """Publish until it is closed."""
        while not self._ended.wait(PERIOD):
            if not self._updater.publisher.get_num_connections():
                continue
            self._ask()
            try:
                self._publish()
            except rospy.ROSException:  # the node ends, and has closed the topic
                return

    def _ask(self) -> None:
        """Have the simulation looked at, unless it still owes an answer; wait for it."""
        if self._answered.is_set():
            self._answered.clear()
            self._asked = time.monotonic()
            self._inbox.put(self._answer)
        if self._answered.wait(PATIENCE):
            return
        seconds = time.monotonic() - self._asked
        why = "a scene or script is being read, or a script or a picture does not come to an end"
        self._findings = {**self._findings, _BUSY: Finding(_BUSY, ERROR, f"busy for {seconds:.0f} s: {why}", {})}

    def _answer(self) -> None:
        try:
            self._findings = {one.name: one for one in self._look()}
            self._updater.stamp = self._stamp()
        except Exception as error:  # a flight does not end because it could not be described
            self._findings = {_BUSY: Finding(_BUSY, ERROR, f"cannot be diagnosed: {error!r}", {})}
        self._answered.set()

    def _publish(self) -> None:
        findings = self._findings
        names = {one.name for one in self._updater.tasks}
        for name in names - findings.keys():
            self._updater.removeByName(name)
        for name in findings:  # in this order
            if name not in names:
                self._updater.add(name, self._status)
        self._updater.force_update()

    def _status(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        found = self._findings.get(status.name)
        if found is None:  # a vehicle that has gone meanwhile
            status.summary(DiagnosticStatus.STALE, "not there any more")
            return status
        status.summary(found.level, found.message[:_LONGEST])
        for key, value in found.values.items():
            status.add(key, value[:_LONGEST])
        return status


class _Updater(Updater):
    """Stamps like everything else of a step, and tells of what is new with all the rest."""

    stamp = rospy.Time()

    def __init__(self) -> None:
        super().__init__()
        self.setHardwareID("none")  # so the updater's own documentation wants it

    def addedTaskCallback(self, _task: Any) -> None:
        pass

    def publish(self, statuses: list[DiagnosticStatus]) -> None:
        node = rospy.get_name()[1:]
        for one in statuses:
            one.name = f"{node}: {one.name}"
        message = DiagnosticArray(status=statuses)
        message.header.stamp = self.stamp
        self.publisher.publish(message)
