"""Lockstep: the next step waits until the nodes that control the vehicles have answered the last one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import rospy

from drone_sim.config.types import ParameterError
from drone_sim.message_text import near_names, shown
from drone_sim.ros.core import connections
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import ros_time
from drone_sim.ros.core.validation import sender
from drone_sim.run.diagnosis.finding import WARN, Finding, Problem, finding
from drone_sim.run.pacing import Throttle
from drone_sim.run.parameters import AwaitedTopic, LockstepParameters
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle

_CLOCK = "/clock"
_STAMPED_TOPIC = "/cmd_vel_stamped"  # the end of the topic whose messages name the stamp that they answer
# s of real time without a new connection; the second one if another node than the sender is triggered
_SETTLE_TIME, _INDIRECT_SETTLE_TIME = 0.5, 1.5
_MIN_CLOCK_TIME = 0.1  # s of real time in which nodes that sleep see the first time of a run
_WARNING_PERIOD = 10.0  # s, between two warnings of the same kind

Callback = Callable[[Any], None]


class NoAnswer(RuntimeError):
    """A node has not answered in time, and the simulation is to end; one line."""


@dataclass
class _AwaitedTopic:
    """A topic, and the messages that trigger its messages."""

    topic: str
    vehicle: str
    entry: AwaitedTopic
    trigger: str  # the topic that must have a subscriber
    camera: str = ""  # name of the camera whose picture is the trigger
    triggers: int = 0  # since the beginning of the run
    sender_names: str = ""  # of the nodes that could answer the last time that there were any


@dataclass
class _PendingAnswer:
    """An answer that the next step waits for."""

    awaited: _AwaitedTopic
    stamp: rospy.Time
    senders: list[Any]  # connections of the nodes that could answer
    names: str  # of these nodes; if all have gone, of those that could answer before
    sent_before: int  # messages on the trigger's topic
    since: float  # s, monotonic
    has_arrived: bool = False
    is_late: bool = False

    def refusal(self, message: Any) -> str:
        """Return why a message is not the answer; '' if it is."""
        if self.has_arrived:
            return "doubled"
        if self.awaited.topic.endswith(_STAMPED_TOPIC):
            return "" if message.header.stamp == self.stamp else "of another stamp"
        trigger = self.awaited.trigger
        if not self.is_triggered():
            return "early"
        if trigger == _CLOCK:  # the node may answer any message of the step, and these are written in any order
            return ""
        # If the node is connected, the trigger must have been given to its socket.
        links = [each for each in connections.subscribers_of(trigger) if each.endpoint_id == sender(message)]
        return "early" if any(map(connections.has_queued, links)) else ""

    def is_triggered(self) -> bool:
        """Return whether the trigger has been published: not if the step has failed."""
        return connections.sent_count(self.awaited.trigger) > self.sent_before


class Lockstep:
    """Begins a wait for each step, takes the answers, and says when the next step may begin.

    rospy's threads call what `gate` returns; everything else is called by the thread that owns the simulation. The
    first step of a run only starts the clock: nodes that sleep on /clock need a time to begin with. Then time stands
    until the nodes are connected, and the messages of the second step are the first that must be answered.
    """

    def __init__(
        self,
        parameters: LockstepParameters,
        simulation: Simulation,
        inbox: Inbox,
        clock: Callable[[], float] = time.monotonic,
    ):
        """Wait as `parameters` say; the thread of `simulation` empties `inbox`. Raises ParameterError.

        `clock` returns real time in s.
        """
        self._parameters, self._simulation, self._inbox, self._clock = parameters, simulation, inbox, clock
        self._lock = threading.Lock()
        self._awaited: dict[str, _AwaitedTopic] = {}  # by topic
        self._pending: dict[str, _PendingAnswer] = {}  # by topic
        self._stale_answers: dict[str, _PendingAnswer] = {}  # from before a start or a restore; they are ignored
        self._sent_before: dict[str, int] = {}  # messages on each trigger before the step
        self._topology_version = self._run = self._first_topology = -1
        self._problems: list[str] = []  # why topics of `wait_for` cannot be awaited
        self._has_connected = False  # whether the nodes have been connected since the node began
        self._waiting_since: float | None = None  # s, where time stands until nodes are connected
        self._connections: set[tuple[str, str]] = set()
        self._changed_at = self._looked_at = clock()  # s, when connections changed; when somebody asked `is_ready`
        self._ignored: dict[str, int] = {}  # messages, by the reason
        self._timeouts, self._waits, self._waited = 0, 0, 0.0
        self._throttle = Throttle(_WARNING_PERIOD)
        self._update_topics(is_startup=True)

    # ---- messages

    def gate(self, topic: str, callback: Callback) -> Callback:
        """Return a callback that passes messages of a topic on to `callback`; of an awaited one the answers alone."""
        name = rospy.resolve_name(topic)

        def pass_on(message: Any) -> None:
            if name not in self._awaited:
                callback(message)
                return
            with self._lock:
                is_stale = self._stale_answers.pop(name, None) is not None
                answer = self._pending.get(name)
                refusal = "of the last run" if is_stale else answer.refusal(message) if answer else "not asked for"
                if answer and not refusal:
                    answer.has_arrived = True
                else:
                    self._ignored[refusal] = self._ignored.get(refusal, 0) + 1
            if answer and not refusal:
                self._inbox.put(lambda: self._accept(name, answer, callback, message))

        return pass_on

    def _accept(self, name: str, answer: _PendingAnswer, callback: Callback, message: Any) -> None:
        """Execute an answer, unless the run has ended, or the wait for it."""
        if self._pending.get(name) is not answer or self._simulation.run != self._run:
            return
        try:
            with self._inbox.run_directly():
                callback(message)
        finally:  # also if it fails: the node has answered
            self._pending.pop(name, None)
            waited = self._clock() - answer.since
            self._waits += 1
            self._waited += waited
            if answer.is_late:
                rospy.logwarn(f"lockstep: {name}: answered after {waited:.1f} s")

    # ---- steps

    def begin_waits(self) -> None:
        """Await answers to the messages of the step that runs next.

        That is before the step, because its scripts may publish, and nodes may answer, before it has ended.
        """
        self._update_topics()
        if self._run != self._simulation.run:
            self._begin_run()
        self._sent_before = {each.trigger: connections.sent_count(each.trigger) for each in self._awaited.values()}
        if self._simulation.steps > 0:
            stamp = ros_time((self._simulation.steps + 1) * self._simulation.clock.time_step)
            for awaited in self._awaited.values():
                if not awaited.camera:
                    self._begin_wait(awaited, stamp)

    def begin_late_waits(self) -> None:
        """Await answers to the pictures of the step that has just run, and to messages of vehicles that it added."""
        if self._simulation.steps == 1:
            self._wait_for_connections()
            return
        before = self._awaited
        self._update_topics()
        for name, awaited in self._awaited.items():
            if awaited.camera:
                camera = self._simulation.vehicles[awaited.vehicle].cameras[awaited.camera]
                if camera.image is not None:
                    self._begin_wait(awaited, ros_time(max(0.0, self._simulation.time - camera.age)))
            elif name not in before:
                self._begin_wait(awaited, ros_time(self._simulation.time))

    def _begin_wait(self, awaited: _AwaitedTopic, stamp: rospy.Time) -> None:
        awaited.triggers += 1
        if awaited.triggers % (awaited.entry.every * (awaited.entry.steps or 1)) == 0:
            before = self._sent_before.get(awaited.trigger)
            before = connections.sent_count(awaited.trigger) if before is None else before
            senders = connections.publishers_of(awaited.topic)
            awaited.sender_names = _names(senders) or awaited.sender_names  # they may have gone since their last answer
            names = awaited.sender_names or "a node that is not known"
            self._pending[awaited.topic] = _PendingAnswer(awaited, stamp, senders, names, before, self._clock())

    def is_ready(self) -> bool:
        """Return whether the next step may begin. Raises NoAnswer and ParameterError."""
        self._looked_at = self._clock()
        if self._run != self._simulation.run:  # the first step of a run waits for nobody
            return True
        if self._waiting_since is not None and not self._are_nodes_connected():
            return False
        for name, answer in list(self._pending.items()):
            self._apply_timeout(name, answer)
        return not self._pending and self._waiting_since is None

    def skip_pause(self) -> None:
        """Do not count the time since the last `is_ready` or `skip_pause`: the simulation was paused or stopped."""
        now = self._clock()
        pause, self._looked_at = now - self._looked_at, now
        if self._waiting_since is not None:
            self._waiting_since = min(self._waiting_since + pause, now)
        for answer in self._pending.values():
            answer.since = min(answer.since + pause, now)

    def reset(self) -> None:
        """Ignore the answers that are awaited, and wait for the nodes again: time has jumped to a snapshot."""
        if self._run != self._simulation.run:
            return
        if self._simulation.steps == 0:
            self._run = -1  # the next step is the first one again
            return
        self._begin_run()
        self._wait_for_connections()

    def _begin_run(self) -> None:
        self._run = self._simulation.run
        if self._first_topology < 0:
            self._first_topology = self._topology_version
        with self._lock:
            for name, answer in self._pending.items():
                if answer.is_triggered() and not (answer.has_arrived or name.endswith(_STAMPED_TOPIC)):
                    self._stale_answers[name] = answer
            self._pending = {}
        for awaited in self._awaited.values():
            awaited.triggers = 0

    def _apply_timeout(self, name: str, answer: _PendingAnswer) -> None:
        """Apply the policy if the node that should answer has gone, or has had its time."""
        is_gone = all(each.done or each.socket is None for each in answer.senders)
        waited = self._clock() - answer.since
        if answer.has_arrived or not (is_gone or waited > self._parameters.timeout):
            return
        policy = self._parameters.on_timeout
        why = "has gone" if is_gone else f"has not answered within {self._parameters.timeout:g} s"
        line = f"lockstep: {name}: {answer.names} {why} (the stamp is {answer.stamp.to_sec():.2f} s)"
        self._timeouts += not answer.is_late
        if policy == "end":
            raise NoAnswer(f"{line}; lockstep/on_timeout is `end`")
        if policy == "hold" and not is_gone:
            if not answer.is_late:
                rospy.logwarn(f"{line}; waiting on")
            answer.is_late = True
            return
        if policy == "hold" or self._throttle.passes():
            rospy.logwarn(f"{line}; {'waiting for a new one' if policy == 'hold' else 'going on without the answer'}")
        del self._pending[name]
        if policy == "hold":
            self._wait_for_connections()

    # ---- nodes that are to connect

    def _wait_for_connections(self) -> None:
        self._waiting_since = self._clock()
        self._throttle = Throttle(_WARNING_PERIOD)

    def _are_nodes_connected(self) -> bool:
        """Return whether all nodes are connected, and none of their connections has been added for a while."""
        self._update_topics()
        now = self._clock()
        # The connections of awaited topics and triggers count, and all those of the nodes that are to answer, but not
        # /clock: nodes that have nothing to do with the flight connect to it at any time.
        topics = {*self._awaited, *(awaited.trigger for awaited in self._awaited.values())} - {_CLOCK}
        senders = {each.callerid_pub for each in self._senders()}
        relevant = {
            (topic, node) for topic, node in connections.all_connections() if topic in topics or node in senders
        }
        if relevant != self._connections:
            self._connections, self._changed_at = relevant, now
        with self._lock:
            timeout = self._parameters.timeout
            self._stale_answers = {k: old for k, old in self._stale_answers.items() if now - old.since < timeout}
        is_direct = all(map(_is_direct, self._awaited.values()))
        has_settled = now - self._changed_at > (_SETTLE_TIME if is_direct else _INDIRECT_SETTLE_TIME)
        assert self._waiting_since is not None
        has_shown_time = now - self._waiting_since > _MIN_CLOCK_TIME
        obstacle = self._obstacle(is_checked=True)
        if has_settled and has_shown_time and not (obstacle or self._stale_answers):
            self._waiting_since, self._has_connected = None, True
            for awaited in self._awaited.values():
                awaited.sender_names = _names(connections.publishers_of(awaited.topic))
            rospy.loginfo(f"lockstep: {self._simulation.time:.2f} s: in step with {_names(self._senders())}")
            return True
        self._report_missing(obstacle, now - self._waiting_since)
        return False

    def _obstacle(self, is_checked: bool = False) -> str:
        """Return in words why time stands, '' if all nodes are connected. Raises ParameterError if `is_checked`."""
        problems = self._problems + self._unreceived_topics(is_checked)
        if problems:
            return f"because {'; '.join(problems)}"
        missing = []
        for awaited in self._awaited.values():
            if not connections.publishers_of(awaited.topic):
                missing.append(f"a publisher of {awaited.topic}")
            if awaited.trigger != _CLOCK and not connections.subscribers_of(awaited.trigger):
                missing.append(f"a subscriber of {awaited.trigger}")
        return f"until there is {' and '.join(missing)}" if missing else ""

    def _report_missing(self, obstacle: str, waited: float) -> None:
        if not obstacle:
            return
        limit = self._parameters.start_timeout
        is_limited = self._parameters.on_timeout != "hold"
        line = f"lockstep: time stands at {self._simulation.time:.2f} s {obstacle}"
        if waited > 1.0 and self._throttle.passes():
            rospy.logwarn(f"{line} (at most {limit:g} s)" if is_limited else line)
        if waited > limit and is_limited:
            raise NoAnswer(f"{line}: it did not come within {limit:g} s (lockstep/start_timeout)")

    def _senders(self) -> list[Any]:
        """Return the connections of the nodes that are to answer."""
        return [each for name in self._awaited for each in connections.publishers_of(name)]

    # ---- topics

    def _update_topics(self, is_startup: bool = False) -> None:
        """Find the topics of the vehicles that fly now.

        At startup, raises ParameterError for an unknown trigger. Later, when another scene has other cameras, that is
        logged, and time stands.
        """
        if self._topology_version == self._simulation.topology_version:
            return
        self._topology_version, before = self._simulation.topology_version, self._awaited
        found, problems = [], []
        for entry in self._parameters.wait_for:
            try:
                found += _awaited_topics(entry, self._simulation.vehicles)
            except ParameterError as error:
                if is_startup:
                    raise
                problems.append(str(error))
        for each in found:
            if each.topic in before:
                each.triggers, each.sender_names = before[each.topic].triggers, before[each.topic].sender_names
        self._awaited = {each.topic: each for each in found}
        with self._lock:
            self._pending = {name: answer for name, answer in self._pending.items() if name in self._awaited}
        if problems and not self._problems:
            rospy.logwarn(f"lockstep: time stands because {'; '.join(problems)}")
            self._wait_for_connections()
        self._problems = problems

    def _unreceived_topics(self, is_checked: bool) -> list[str]:
        """Return a line for each awaited topic that neither a vehicle nor its script listens to.

        Raises ParameterError if `is_checked` and the simulation has not been in step since its start: then it is a
        mistake in `wait_for`. Later, a scene or a script may have changed.
        """
        received, problems = connections.received_topics(), []
        for awaited in self._awaited.values():
            if awaited.topic not in received:
                prefix = f"{rospy.resolve_name(awaited.vehicle)}/"
                known = [topic.removeprefix(prefix) for topic in received if topic.startswith(prefix)]
                why = f"nothing listens to {awaited.topic}; {near_names(awaited.entry.topic, known)}"
                if is_checked and not self._has_connected and self._topology_version == self._first_topology:
                    raise ParameterError(why, ("lockstep", "wait_for"), shown(awaited.entry.topic))
                problems.append(why)
        return problems

    # ---- diagnosis

    def finding(self) -> Finding:
        """Return the line and values for /diagnostics."""
        nodes = _names(self._senders())
        mean = f"{self._waited / self._waits * 1e3:.2f} ms" if self._waits else "not known"
        values = {
            "waits for": ", ".join(f"{name} (after {each.entry.trigger})" for name, each in self._awaited.items()),
            "nodes": nodes,
            "mean wait": mean,
            "answers": str(self._waits),
            "timeouts": str(self._timeouts),
            "ignored messages": ", ".join(f"{count} {why}" for why, count in sorted(self._ignored.items())) or "none",
        }
        line = f"in step with {nodes or 'nobody yet'}; mean wait {mean}"
        return finding("lockstep", line, list(self._find_problems()), values)

    def _find_problems(self) -> Iterator[Problem]:
        now = self._clock()
        for name, answer in self._pending.items():
            if answer.is_late:
                stamp, waited = answer.stamp.to_sec(), now - answer.since
                yield Problem(WARN, f"{name}: {answer.names} has not answered the stamp {stamp:.2f} for {waited:.0f} s")
        if self._waiting_since is not None:
            reason = self._obstacle() or "until connections have settled"
            yield Problem(WARN, f"time stands at {self._simulation.time:.2f} s {reason}")
        for name in self._awaited:
            rivals = sorted({each.callerid_pub for each in connections.publishers_of(name)})
            if len(rivals) > 1:
                text = f"of the answers of {', '.join(rivals)} the first counts: the flight is not repeatable"
                yield Problem(WARN, f"{name}: {text}")


def _awaited_topics(entry: AwaitedTopic, vehicles: dict[str, Vehicle]) -> list[_AwaitedTopic]:
    """Return what an entry of `wait_for` means for the vehicles that fly now. Raises ParameterError."""
    first = entry.topic.split("/")[0]
    if entry.topic.startswith("/") or first in vehicles:
        full = rospy.resolve_name(entry.topic)
        owner = [name for name in vehicles if full.startswith(f"{rospy.resolve_name(name)}/")] or list(vehicles)
        return [_awaited_topic(full, name, vehicles[name], entry) for name in owner[:1]]
    return [
        _awaited_topic(rospy.resolve_name(f"{name}/{entry.topic}"), name, vehicles[name], entry) for name in vehicles
    ]


def _awaited_topic(topic: str, name: str, vehicle: Vehicle, entry: AwaitedTopic) -> _AwaitedTopic:
    if entry.steps:
        return _AwaitedTopic(topic, name, entry, _CLOCK)
    if entry.trigger == "odom":
        return _AwaitedTopic(topic, name, entry, rospy.resolve_name(f"{name}/odom"))
    cameras = {each.topic: key for key, each in vehicle.parameters.cameras.items()}
    camera = cameras.get(entry.trigger.removesuffix("/compressed"))
    if camera is None:
        why = f"no such trigger; {near_names(entry.trigger, ['step', '4 steps', 'odom', *cameras])}"
        raise ParameterError(why, ("lockstep", "trigger"), shown(entry.trigger))
    return _AwaitedTopic(topic, name, entry, rospy.resolve_name(f"{name}/{entry.trigger}"), camera)


def _names(senders: list[Any]) -> str:
    return ", ".join(sorted({each.callerid_pub for each in senders}))


def _is_direct(awaited: _AwaitedTopic) -> bool:
    """Return whether a node that publishes the awaited topic also subscribes to the trigger."""
    senders = {each.callerid_pub for each in connections.publishers_of(awaited.topic)}
    return any(each.endpoint_id in senders for each in connections.subscribers_of(awaited.trigger))
