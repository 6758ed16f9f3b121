"""Lockstep: the next step waits until the nodes that control the vehicles have answered the last one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import rospy

from drone_sim.config.types import ParameterError
from drone_sim.message_text import near_names, shown
from drone_sim.ros.core import connections
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import ros_time
from drone_sim.ros.core.validation import sender
from drone_sim.run.diagnosis.finding import WARN, Finding, Problem, finding
from drone_sim.run.lockstep_parameters import AwaitedTopic, LockstepParameters
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle

_CLOCK = "/clock"
_BY_STAMP = "/cmd_vel_stamped"  # the end of the topic whose messages name the stamp that they answer
_SETTLED, _INDIRECT = 0.5, 1.5  # s of real time without a new connection; if another node than the sender is triggered
_SHORTEST = 0.1  # s of real time in which nodes that sleep see the first time of a run
_QUIET = 10.0  # s, between two warnings of the same kind

Take = Callable[[Any], None]


class NoAnswer(RuntimeError):
    """A node has not answered in time, and the simulation is to end; one line."""


@dataclass
class _Expected:
    """A topic, and the messages that trigger its messages."""

    topic: str
    vehicle: str
    entry: AwaitedTopic
    trigger: str  # the topic that must have a subscriber
    camera: str = ""  # name of the camera whose picture is the trigger
    triggers: int = 0  # since the beginning of the run

    def is_triggered(self, simulation: Simulation) -> bool:
        """Count the trigger of the present step, if there is one; return whether it is to be answered."""
        if self.camera and simulation.vehicles[self.vehicle].cameras[self.camera].image is None:
            return False
        self.triggers += 1
        return self.triggers % (self.entry.every * (self.entry.steps or 1)) == 0

    def stamp(self, simulation: Simulation) -> rospy.Time:
        """Return the stamp of the trigger that was published last."""
        age = simulation.vehicles[self.vehicle].cameras[self.camera].age if self.camera else 0.0
        return ros_time(max(0.0, simulation.time - age))


@dataclass
class _Awaited:
    """An answer that the next step waits for."""

    expected: _Expected
    stamp: rospy.Time
    senders: list[Any]  # connections of those that could answer
    sent_before: int  # messages on the trigger's topic
    since: float = field(default_factory=time.monotonic)  # s
    has_arrived: bool = False
    is_late: bool = False

    @property
    def nodes(self) -> str:
        return ", ".join(sorted({one.callerid_pub for one in self.senders})) or "a node that is not known"

    def refusal(self, message: Any) -> str:
        """Return why a message is not the answer; '' if it is."""
        if self.has_arrived:
            return "doubled"
        if self.expected.topic.endswith(_BY_STAMP):
            return "" if message.header.stamp == self.stamp else "of another stamp"
        return "" if self._could_be_seen_by(sender(message)) else "early"

    def _could_be_seen_by(self, node: str) -> bool:
        """Return whether the trigger has been published, and been written to the node's socket if it is connected."""
        trigger = self.expected.trigger
        if connections.sent_count(trigger) <= self.sent_before:
            return False
        if trigger == _CLOCK:  # the node may answer any message of the step, and these are written in any order
            return True
        own = [one for one in connections.subscribers_of(trigger) if one.endpoint_id == node]
        return not any(map(connections.has_unwritten, own))


class Lockstep:
    """Opens a wait for each step, takes the answers, and says when the next step may begin.

    rospy's threads call what `gate` returns; everything else is called by the thread that owns the simulation. The
    first step of a run only starts the clock: nodes that sleep on /clock need a time to begin with. Then time stands
    until the nodes are connected, and the messages of the second step are the first that must be answered.
    """

    def __init__(self, parameters: LockstepParameters, simulation: Simulation, inbox: Inbox):
        """Wait as `parameters` say; the thread of `simulation` empties `inbox`. Raises ParameterError."""
        self._parameters, self._simulation, self._inbox = parameters, simulation, inbox
        self._lock = threading.Lock()
        self._open: dict[str, _Awaited] = {}  # by topic
        self._owed: dict[str, _Awaited] = {}  # answers to the end of the run before, which are ignored
        self._expected: dict[str, _Expected] = {}  # by topic
        self._topology_version = self._run = -1
        self._standing_since: float | None = None  # s, where time stands until nodes are connected
        self._connections: set[tuple[str, str]] = set()
        self._changed_at = 0.0  # s, when the connections changed
        self._ignored: dict[str, int] = {}  # messages, by the reason
        self._timeouts, self._waits, self._waited = 0, 0, 0.0
        self._throttle = Throttle(_QUIET)
        self._follow()

    # ---- messages

    def gate(self, topic: str, take: Take) -> Take:
        """Return a callback that passes messages of a topic on to `take`; of an awaited one the answers alone."""
        name = rospy.resolve_name(topic)

        def pass_on(message: Any) -> None:
            if name not in self._expected:
                take(message)
                return
            with self._lock:
                owed = self._owed.pop(name, None)
                awaited = self._open.get(name)
                refusal = "of the last run" if owed else awaited.refusal(message) if awaited else "not asked for"
                if awaited and not refusal:
                    awaited.has_arrived = True
                else:
                    self._ignored[refusal] = self._ignored.get(refusal, 0) + 1
            if awaited and not refusal:
                self._inbox.put(lambda: self._accept(name, awaited, take, message))

        return pass_on

    def _accept(self, name: str, awaited: _Awaited, take: Take, message: Any) -> None:
        """Execute an answer, unless the run has ended, or the wait for it."""
        if self._open.get(name) is awaited and self._simulation.run == self._run:
            with self._inbox.run_directly():
                take(message)
            del self._open[name]
            self._waits += 1
            self._waited += time.monotonic() - awaited.since
            if awaited.is_late:
                rospy.logwarn(f"lockstep: {name}: answered after {time.monotonic() - awaited.since:.1f} s")

    # ---- steps

    def open(self) -> bool:
        """Await answers to the messages of the step that has just run, before they are published.

        Return False for the first step of a run, of which only /clock is to be published.
        """
        self._follow()
        if self._run != self._simulation.run:
            self._begin_run()
        if self._simulation.steps == 1:
            self._stand()
            return False
        for name, expected in self._expected.items():
            if expected.is_triggered(self._simulation):
                senders, before = connections.publishers_of(name), connections.sent_count(expected.trigger)
                self._open[name] = _Awaited(expected, expected.stamp(self._simulation), senders, before)
        return True

    def is_ready(self) -> bool:
        """Return whether the next step may begin. Raises NoAnswer and ParameterError."""
        if self._run != self._simulation.run:  # the first step of a run waits for nobody
            return True
        if self._standing_since is not None and not self._are_nodes_there():
            return False
        for name, awaited in list(self._open.items()):
            self._look_at(name, awaited)
        return not self._open and self._standing_since is None

    def _begin_run(self) -> None:
        self._run = self._simulation.run
        with self._lock:
            plain = {name: one for name, one in self._open.items() if not name.endswith(_BY_STAMP)}
            self._owed = {name: one for name, one in plain.items() if not one.has_arrived}
            self._open = {}
        for expected in self._expected.values():
            expected.triggers = 0

    def _look_at(self, name: str, awaited: _Awaited) -> None:
        """Apply the policy if the node that should answer has gone, or has had its time."""
        is_gone = all(one.done or one.socket is None for one in awaited.senders)
        waited = time.monotonic() - awaited.since
        if awaited.has_arrived or not (is_gone or waited > self._parameters.timeout):
            return
        policy = self._parameters.on_timeout
        why = "has gone" if is_gone else f"has not answered within {self._parameters.timeout:g} s"
        line = f"lockstep: {name}: {awaited.nodes} {why} (the stamp is {awaited.stamp.to_sec():.2f} s)"
        self._timeouts += not awaited.is_late
        if policy == "end":
            raise NoAnswer(f"{line}; lockstep/on_timeout is `end`")
        if policy == "hold" and not is_gone:
            if not awaited.is_late:
                rospy.logwarn(f"{line}; waiting on")
            awaited.is_late = True
            return
        if policy == "hold" or self._throttle.passes():
            rospy.logwarn(f"{line}; {'waiting for a new one' if policy == 'hold' else 'going on without the answer'}")
        del self._open[name]
        if policy == "hold":
            self._stand()

    # ---- nodes that are to connect

    def _stand(self) -> None:
        self._standing_since = time.monotonic()
        self._throttle = Throttle(_QUIET)

    def _are_nodes_there(self) -> bool:
        """Return whether all nodes are connected, and no connection has been added for a while."""
        self._check_topics()
        now, present = time.monotonic(), connections.all_connections()
        if present != self._connections:
            self._connections, self._changed_at = present, now
        missing = [text for one in self._expected.values() for text in _missing(one)]
        is_direct = all(map(_is_direct, self._expected.values()))
        with self._lock:
            self._owed = {name: one for name, one in self._owed.items() if now - one.since < self._parameters.timeout}
        has_settled = now - self._changed_at > (_SETTLED if is_direct else _INDIRECT)
        has_shown_time = self._standing_since is not None and now - self._standing_since > _SHORTEST
        if has_settled and has_shown_time and not (missing or self._owed):
            self._standing_since = None
            rospy.loginfo(f"lockstep: {self._simulation.time:.2f} s: in step with {self._nodes()}")
            return True
        self._tell_missing(missing, now)
        return False

    def _tell_missing(self, missing: list[str], now: float) -> None:
        assert self._standing_since is not None
        limit, waited = self._parameters.start_timeout, now - self._standing_since
        said = f"lockstep: time stands at {self._simulation.time:.2f} s until there is {' and '.join(missing)}"
        if missing and waited > 1.0 and self._throttle.passes():
            rospy.logwarn(f"{said} (at most {limit:g} s)" if waited < limit else said)
        if missing and waited > limit and self._parameters.on_timeout != "hold":
            raise NoAnswer(f"{said}: it did not come within {limit:g} s (lockstep/start_timeout)")

    def _nodes(self) -> str:
        senders = {one.callerid_pub for name in self._expected for one in connections.publishers_of(name)}
        return ", ".join(sorted(senders))

    # ---- topics

    def _follow(self) -> None:
        """Find the topics of the vehicles that fly now. Raises ParameterError for a trigger that there is not."""
        if self._topology_version == self._simulation.topology_version:
            return
        self._topology_version, before = self._simulation.topology_version, self._expected
        found = [one for entry in self._parameters.wait_for for one in _expectations(entry, self._simulation.vehicles)]
        self._expected = {one.topic: before.get(one.topic, one) for one in found}
        with self._lock:
            self._open = {name: one for name, one in self._open.items() if name in self._expected}

    def _check_topics(self) -> None:
        """Raise ParameterError for an awaited topic that neither a vehicle nor its script listens to."""
        received = connections.received_topics()
        for one in self._expected.values():
            if one.topic not in received:
                prefix = f"{rospy.resolve_name(one.vehicle)}/"
                known = [topic.removeprefix(prefix) for topic in received if topic.startswith(prefix)]
                why = f"nothing listens to {one.topic}; {near_names(one.entry.topic, known)}"
                raise ParameterError(why, ("lockstep", "wait_for"), shown(one.entry.topic))

    # ---- diagnosis

    def finding(self) -> Finding:
        """Return what /diagnostics says."""
        now, problems = time.monotonic(), []
        for name, one in self._open.items():
            if one.is_late:
                what = f"{one.nodes} has not answered the stamp {one.stamp.to_sec():.2f} for {now - one.since:.0f} s"
                problems.append(Problem(WARN, f"{name}: {what}"))
        if self._standing_since is not None:
            missing = [text for one in self._expected.values() for text in _missing(one)]
            what = " and ".join(missing) or "all nodes are connected"
            problems.append(Problem(WARN, f"time stands at {self._simulation.time:.2f} s until there is {what}"))
        for name in self._expected:
            rivals = sorted({one.callerid_pub for one in connections.publishers_of(name)})
            if len(rivals) > 1:
                what = f"of the answers of {', '.join(rivals)} the first counts: the flight is not repeatable"
                problems.append(Problem(WARN, f"{name}: {what}"))
        mean = f"{self._waited / self._waits * 1e3:.2f} ms" if self._waits else "not known"
        values = {
            "waits for": ", ".join(f"{name} (after {one.entry.trigger})" for name, one in self._expected.items()),
            "nodes": self._nodes(),
            "mean wait": mean,
            "answers": str(self._waits),
            "timeouts": str(self._timeouts),
            "ignored messages": ", ".join(f"{count} {why}" for why, count in sorted(self._ignored.items())) or "none",
        }
        return finding("lockstep", f"in step with {self._nodes() or 'nobody yet'}; mean wait {mean}", problems, values)


def _expectations(entry: AwaitedTopic, vehicles: dict[str, Vehicle]) -> list[_Expected]:
    """Return what an entry of `wait_for` means for the vehicles that fly now. Raises ParameterError."""
    first = entry.topic.split("/")[0]
    if entry.topic.startswith("/") or first in vehicles:
        full = rospy.resolve_name(entry.topic)
        owner = [name for name in vehicles if full.startswith(f"{rospy.resolve_name(name)}/")] or list(vehicles)
        return [_expected(full, name, vehicles[name], entry) for name in owner[:1]]
    return [_expected(rospy.resolve_name(f"{name}/{entry.topic}"), name, vehicles[name], entry) for name in vehicles]


def _expected(topic: str, name: str, vehicle: Vehicle, entry: AwaitedTopic) -> _Expected:
    if entry.steps:
        return _Expected(topic, name, entry, _CLOCK)
    if entry.trigger == "odom":
        return _Expected(topic, name, entry, rospy.resolve_name(f"{name}/odom"))
    cameras = {one.topic: key for key, one in vehicle.parameters.cameras.items()}
    camera = cameras.get(entry.trigger.removesuffix("/compressed"))
    if camera is None:
        why = f"no such trigger; {near_names(entry.trigger, ['step', '4 steps', 'odom', *cameras])}"
        raise ParameterError(why, ("lockstep", "trigger"), shown(entry.trigger))
    return _Expected(topic, name, entry, rospy.resolve_name(f"{name}/{entry.trigger}"), camera)


def _missing(expected: _Expected) -> list[str]:
    """Return what is not connected yet, in words."""
    missing = []
    if not connections.publishers_of(expected.topic):
        missing.append(f"a publisher of {expected.topic}")
    if expected.trigger != _CLOCK and not connections.subscribers_of(expected.trigger):
        missing.append(f"a subscriber of {expected.trigger}")
    return missing


def _is_direct(expected: _Expected) -> bool:
    """Return whether a node that publishes the awaited topic also subscribes to the trigger."""
    senders = {one.callerid_pub for one in connections.publishers_of(expected.topic)}
    return any(one.endpoint_id in senders for one in connections.subscribers_of(expected.trigger))
