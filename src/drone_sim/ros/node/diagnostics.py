"""/diagnostics: once a second of real time, only for subscribers."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.network import FAILURES, call
from drone_sim.run.diagnosis.finding import ERROR, Finding
from drone_sim.run.pacing import Throttle
from drone_sim.run.profiles import command_topics

PERIOD = 1.0  # s of real time
PATIENCE = 2.0  # s, for the simulation's answer
_MASTER_PERIOD = 5.0  # s of real time, between two requests to the master
_TWISTS = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
_MAX_LENGTH = 600  # characters of a value
_BUSY = "simulation"  # name of the finding that the simulation does not answer


class Diagnostics(threading.Thread):
    """A daemon thread that asks the simulation's thread for findings between two steps, and publishes them.

    Without subscribers it does not disturb the steps. diagnostic_updater is not used: it asks the master for its
    period, and fails without a master; it uses its own stamps, and publishes a new entry before all others.
    """

    def __init__(self, look: Callable[[], list[Finding]], stamp: Callable[[], rospy.Time], inbox: Inbox):
        """Advertise. `look` returns the findings; it and `stamp` are called in the thread that runs `inbox`'s jobs."""
        super().__init__(name="diagnostics", daemon=True)
        self._look, self._stamp, self._inbox = look, stamp, inbox
        self._ended = threading.Event()
        self._findings: dict[str, Finding] = {}
        self._answered = threading.Event()
        self._answered.set()
        self._asked = 0.0  # s, of the monotonic clock
        self._stamped = rospy.Time()
        self.unheard: dict[str, list[str]] = {}  # last result of unheard_commands
        self._master_throttle = Throttle(_MASTER_PERIOD)
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        rospy.on_shutdown(self.close)

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        self._ended.set()

    def run(self) -> None:
        while not self._ended.wait(PERIOD):
            if not self._publisher.get_num_connections():
                continue
            if self._master_throttle.passes():
                self.unheard = unheard_commands()
            self._ask()
            try:
                message = DiagnosticArray(status=list(map(_status, self._findings.values())))
                message.header.stamp = self._stamped
                self._publisher.publish(message)
            except rospy.ROSException:  # the node ends, and has closed the topic
                return

    def _ask(self) -> None:
        """Request new findings, unless a request is still unanswered; wait for the answer for PATIENCE."""
        if self._answered.is_set():
            self._answered.clear()
            self._asked = time.monotonic()
            self._inbox.put(self._answer)
        if self._answered.wait(PATIENCE):
            return
        seconds = time.monotonic() - self._asked
        why = "a scene or script is being read, or a script or a picture takes very long"
        self._findings = {**self._findings, _BUSY: Finding(_BUSY, ERROR, f"busy for {seconds:.0f} s: {why}", {})}

    def _answer(self) -> None:
        try:
            self._findings = {finding.name: finding for finding in self._look()}
            self._stamped = self._stamp()
        except Exception as error:  # a flight does not end because it could not be described
            self._findings = {_BUSY: Finding(_BUSY, ERROR, f"cannot be diagnosed: {error!r}", {})}
            rospy.logdebug(traceback.format_exc())
        self._answered.set()


def unheard_commands() -> dict[str, list[str]]:
    """Return topics that look like commands, without subscribers, with the publishing nodes, from the master.

    These are Twists, and the names of a driver or of ours, such as /bebop/takeoff. A node that was started without a
    remapping, or that is written for a driver, publishes commands on such a topic. If the master does not answer,
    there are none.
    """
    uri = rosgraph.get_master_uri()
    try:
        published, subscribed, _ = map(dict, call(uri, "getSystemState"))
        kinds = dict(call(uri, "getTopicTypes"))
    except (*FAILURES, TypeError):  # TypeError: an answer of another shape
        return {}
    others = {topic: [node for node in nodes if node != rospy.get_name()] for topic, nodes in published.items()}
    return {
        topic: nodes
        for topic, nodes in sorted(others.items())
        if nodes and not subscribed.get(topic) and (kinds.get(topic) in _TWISTS or topic in command_topics())
    }


def _status(finding: Finding) -> DiagnosticStatus:
    values = [KeyValue(key, value[:_MAX_LENGTH]) for key, value in finding.values.items()]
    name = f"{rospy.get_name()[1:]}: {finding.name}"
    return DiagnosticStatus(finding.level, name, finding.message[:_MAX_LENGTH], "none", values)  # no hardware
