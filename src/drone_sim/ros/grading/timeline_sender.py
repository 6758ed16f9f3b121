"""A timeline's entries as the messages that ask for the same."""

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
from drone_sim.offline.timeline import (
    CHANGES,
    Entry,
    ObjectMove,
    ScriptRequest,
    Timeline,
    first_step,
)
from drone_sim.ros.core.message_conversion import WORLD_FRAME, twist
from drone_sim.ros.grading.simulator import Mismatch
from drone_sim.run.parameters import Parameters

_HERE = 1e-9  # s
_IN_WORLD = Header(frame_id=WORLD_FRAME)
_DEEPEST = 4  # keys that a message on `weather` or `faults` may name


class TimelineSender:
    """Sends what is due, each entry once, in order."""

    def __init__(self, entries: list[Entry], parameters: Parameters, simulator: str):
        """Advertise what `entries` need of the node `simulator`, by the `parameters` that are flown with.

        Raises Mismatch for an entry that no topic can ask for.
        """
        self._step = parameters.time_step
        self._first = parameters.first.name
        push = parameters.push.duration
        self._left: list[tuple[float, rospy.Publisher, Any]] = []
        publishers: dict[str, rospy.Publisher] = {}
        for entry in entries:
            for topic, message in _messages(entry, push):
                name = f"/{entry.vehicle or self._first}/{topic}" if topic else f"{simulator}/set_object_pose"
                if name not in publishers:
                    publishers[name] = rospy.Publisher(name, type(message), queue_size=100, tcp_nodelay=True)
                self._left.append((entry.at, publishers[name], message))
        self._publishers = list(publishers.values())

    @property
    def is_heard(self) -> bool:
        """Whether somebody listens to each topic."""
        return all(one.get_num_connections() for one in self._publishers)

    def send(self, time: float) -> None:
        """Send what is due in the step that begins at this simulated time (s), and what was due before."""
        step = first_step(time, self._step)
        while self._left and first_step(self._left[0][0], self._step) <= step:
            _, publisher, message = self._left.pop(0)
            publisher.publish(message)

    def close(self) -> None:
        """Advertise no more."""
        for one in self._publishers:
            one.unregister()


def is_put(entry: Entry) -> bool:
    """Tell whether an entry puts a vehicle elsewhere."""
    return isinstance(entry.action, Pose) or (isinstance(entry.action, ScriptRequest) and entry.action.topic == "reset")


def steps_late(timeline: Timeline, rows: np.ndarray, time_step: float) -> int:
    """Return by how many steps the latest twist of a vehicle's timeline came into force too late.

    `rows` are the vehicle's table. What is due in the first step cannot be in time, and does not count; nor does what
    never came into force, as behind a lossy link.
    """
    late = 0
    for entry in timeline.entries:
        due = first_step(entry.at, time_step)
        if isinstance(entry.action, Twist) and due:
            wanted = (*entry.action.linear, entry.action.angular[2])
            numbers = np.rint(rows[:, 0] / time_step)  # of the steps that end with the rows, from 1
            in_force = numbers[(np.abs(rows[:, 14:18] - wanted) < _HERE).all(axis=1) & (numbers > due)]
            late = max(late, int(in_force[0]) - due - 1 if len(in_force) else 0)
    return late


def _messages(entry: Entry, push: float) -> Iterator[tuple[str, Any]]:
    """Yield topic ('': not a vehicle's) and message of what an entry does; a push by topic lasts `push` s."""
    action = entry.action
    if isinstance(action, ObjectMove):
        turn = Quaternion(*to_quaternion(from_rpy((0, 0, 0), action.rpy))) if action.rpy else Quaternion()
        yield "", TransformStamped(_IN_WORLD, action.name, Transform(Vector3(*action.position), turn))
    elif isinstance(action, Twist):
        yield "cmd_vel", twist(action.linear, action.angular)
    elif isinstance(action, Pose):
        yield "set_pose", _pose(action)
    elif isinstance(action, ScriptRequest):
        yield action.topic, _pose(action.pose) if action.pose else Empty()
    elif isinstance(action, Push):
        if abs(action.duration - push) > _HERE:
            said = f"push.duration = {action.duration:g}: a push by topic lasts push/duration = {push:g} s"
            raise Mismatch(f"the timeline's entry at {entry.at:g} s: {said}; put that into the plan's config")
        yield "push", WrenchStamped(_IN_WORLD, Wrench(Vector3(*action.force), Vector3(*action.torque)))
    else:
        topic = next(name for name, kind in CHANGES.items() if isinstance(action, kind))
        for key, value in _flat(action.changes):
            yield topic, KeyValue(key, dump(value, "line").removesuffix("\n...\n"))


def _flat(changes: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in changes.items():
        if isinstance(value, Mapping) and value and above.count("/") < _DEEPEST - 2:
            yield from _flat(value, f"{above}{key}/")
        else:
            yield f"{above}{key}", value


def _pose(pose: Pose) -> PoseStamped:
    return PoseStamped(_IN_WORLD, PoseMessage(Point(*pose.position), Quaternion(*pose.orientation)))
