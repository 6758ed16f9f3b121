"""Sender of a timeline's entries as ROS messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import (
    Point,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
    Wrench,
    WrenchStamped,
)
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import Empty, Header

from drone_sim.files.yaml_writing import dump
from drone_sim.forces.pushes import Push
from drone_sim.mechanics.frames import from_rpy, to_quaternion
from drone_sim.mechanics.state import Pose, Twist
from drone_sim.offline.timeline import CHANGES, Entry, ObjectMove, ScriptRequest, Timeline, first_step
from drone_sim.ros.core.message_conversion import WORLD_FRAME, twist
from drone_sim.ros.grading.simulator import Mismatch
from drone_sim.run.parameters import Parameters

_ROUNDING = 1e-9
_IN_WORLD = Header(frame_id=WORLD_FRAME)
_MAX_DEPTH = 4  # keys in a message on `weather` or `faults`


class TimelineSender:
    """Sends the entries of a timeline when they are due."""

    def __init__(self, entries: list[Entry], parameters: Parameters, simulator: str):
        """Advertise the topics of the node `simulator` for `entries`; the flight has the given parameters.

        Raises Mismatch for an entry that cannot be sent as a message.
        """
        self._step = parameters.time_step
        self._first = parameters.first.name
        push_duration = parameters.push.duration
        self._pending: list[tuple[float, rospy.Publisher, Any]] = []
        publishers: dict[str, rospy.Publisher] = {}
        for entry in entries:
            for topic, message in _messages(entry, push_duration):
                name = f"/{entry.vehicle or self._first}/{topic}" if topic else f"{simulator}/set_object_pose"
                if name not in publishers:
                    publishers[name] = rospy.Publisher(name, type(message), queue_size=100, tcp_nodelay=True)
                self._pending.append((entry.at, publishers[name], message))
        self._publishers = list(publishers.values())

    @property
    def is_heard(self) -> bool:
        """Whether each topic has a subscriber."""
        return all(publisher.get_num_connections() for publisher in self._publishers)

    def send(self, time: float) -> None:
        """Send the entries that are due in the step that begins at a simulated time (s), or earlier."""
        step = first_step(time, self._step)
        while self._pending and first_step(self._pending[0][0], self._step) <= step:
            _, publisher, message = self._pending.pop(0)
            publisher.publish(message)

    def close(self) -> None:
        for publisher in self._publishers:
            publisher.unregister()


def moves_vehicle(entry: Entry) -> bool:
    """Return whether an entry moves a vehicle to another pose."""
    return isinstance(entry.action, Pose) or (isinstance(entry.action, ScriptRequest) and entry.action.topic == "reset")


def steps_late(timeline: Timeline, rows: np.ndarray, time_step: float) -> int:
    """Return the largest delay, in steps, with which a twist of a vehicle's timeline took effect.

    `rows` are the vehicle's table. Twists of the first step, which cannot be in time, do not count, nor do twists that
    never took effect, such as over a lossy link.
    """
    late = 0
    for entry in timeline.entries:
        due = first_step(entry.at, time_step)
        if isinstance(entry.action, Twist) and due:
            command = (*entry.action.linear, entry.action.angular[2])
            numbers = np.rint(rows[:, 0] / time_step)  # of the steps that end with the rows, from 1
            in_force = numbers[(np.abs(rows[:, 14:18] - command) < _ROUNDING).all(axis=1) & (numbers > due)]
            late = max(late, int(in_force[0]) - due - 1 if len(in_force) else 0)
    return late


def _messages(entry: Entry, push_duration: float) -> Iterator[tuple[str, Any]]:
    """Yield the topics and messages of an entry; '' is set_object_pose. A push by topic lasts `push_duration` s."""
    action = entry.action
    if isinstance(action, ObjectMove):
        rotation = Quaternion(*to_quaternion(from_rpy((0, 0, 0), action.rpy))) if action.rpy else Quaternion()
        yield "", TransformStamped(_IN_WORLD, action.name, Transform(Vector3(*action.position), rotation))
    elif isinstance(action, Twist):
        yield "cmd_vel", twist(action.linear, action.angular)
    elif isinstance(action, Pose):
        yield "set_pose", _pose(action)
    elif isinstance(action, ScriptRequest):
        yield action.topic, _pose(action.pose) if action.pose else Empty()
    elif isinstance(action, Push):
        if abs(action.duration - push_duration) > _ROUNDING:
            reason = f"push.duration = {action.duration:g}: a push by topic lasts push/duration = {push_duration:g} s"
            raise Mismatch(f"the timeline's entry at {entry.at:g} s: {reason}; set that in the plan's config")
        yield "push", WrenchStamped(_IN_WORLD, Wrench(Vector3(*action.force), Vector3(*action.torque)))
    else:
        topic = next(name for name, kind in CHANGES.items() if isinstance(action, kind))
        for key, value in _flatten(action.changes):
            yield topic, KeyValue(key, dump(value, "line").removesuffix("\n...\n"))


def _flatten(changes: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in changes.items():
        if isinstance(value, Mapping) and value and above.count("/") < _MAX_DEPTH - 2:
            yield from _flatten(value, f"{above}{key}/")
        else:
            yield f"{above}{key}", value


def _pose(pose: Pose) -> PoseStamped:
    return PoseStamped(_IN_WORLD, PoseMessage(Point(*pose.position), Quaternion(*pose.orientation)))
