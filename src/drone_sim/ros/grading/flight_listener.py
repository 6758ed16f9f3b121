"""Recorder of a flight on a running simulator: it listens to the simulator's topics."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import rospy
import rostopic
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32MultiArray, String
from visualization_msgs.msg import MarkerArray

from drone_sim.grading.flight_record import ContactEvent, FlightRecord, ValueChange
from drone_sim.grading.permissions import CALL, MAX_TRIED
from drone_sim.grading.plan import Plan
from drone_sim.message_text import printable
from drone_sim.ros.core.message_conversion import odometry_row, xyz
from drone_sim.ros.core.validation import sender
from drone_sim.ros.grading.simulator import Mismatch
from drone_sim.run.parameters import Parameters

_QUEUE_SIZE = 1000  # messages; no message of a graded flight may be lost
_Row = tuple[float, ...]


class FlightListener:
    """Records the graded vehicle's table, and whatever else the plan's criteria need.

    Messages without a stamp (flight state, a script's topics) get the time of the last odometry.
    """

    def __init__(self, plan: Plan, parameters: Parameters, simulator: str, after_step: Callable[[float], None]):
        """Subscribe to the topics of the node `simulator` that `plan` needs, with the vehicles in `parameters`.

        `after_step` is called with the simulated time (s) after each step. Raises Mismatch.
        """
        self._after_step, self._simulator = after_step, simulator
        self._lock = threading.Lock()
        self._subscribers: list[rospy.Subscriber] = []
        self._vehicle = plan.vehicle_of(parameters)
        self.clear()
        self._subscribe(f"/{self._vehicle}/odom", Odometry, self._on_odometry)
        self._subscribe(f"/{self._vehicle}/command", TwistStamped, self._on_command)
        self._subscribe(f"/{self._vehicle}/propellers", Float32MultiArray, self._on_propellers)
        self._subscribe_for_criteria(plan, parameters)
        self._signals = {name for criterion in plan.criteria for name in criterion.signals}
        if self._signals:
            self._subscribe(f"{simulator}/signals", String, self._on_signals)

    def _subscribe_for_criteria(self, plan: Plan, parameters: Parameters) -> None:
        vehicles = [vehicle.name for vehicle in parameters.fleet]
        for criterion in plan.criteria:
            if criterion.signals and not isinstance(getattr(criterion, "equals", 0), (int, float)):
                reason = "only signals that are numbers can be received; publish other values on a topic"
                raise Mismatch(f"criterion {criterion.label}: needs {', '.join(criterion.signals)}: {reason}")
            if objects := [*(name for name in criterion.object_names if name not in vehicles), *criterion.path_names]:
                raise Mismatch(f"criterion {criterion.label}: needs {', '.join(objects)}: objects have no topic")
            for name in criterion.object_names:
                self._subscribe(f"/{name}/odom", Odometry, partial(self._on_other_odometry, name))
            if criterion.needs_contacts:
                own = next(vehicle for vehicle in parameters.fleet if vehicle.name == self._vehicle)
                topics = [sensor.topic for sensor in own.sensors.values() if sensor.kind == "contacts"]
                if not topics:
                    where = "such as that of config/sensors.yaml, in the plan's config and the simulator's"
                    raise Mismatch(f"criterion {criterion.label}: needs the sensor `contacts`, {where}")
                self._subscribe(f"/{self._vehicle}/{topics[0]}", MarkerArray, self._on_contacts)
            if criterion.needs_states:
                self._subscribe(f"/{self._vehicle}/state", String, lambda message: self._add_value("", message.data))
        self._topics = plan.topics_of(parameters)  # of unknown type, until they are advertised

    def _subscribe(self, topic: str, kind: type, callback: Callable[[Any], None], from_any_node: bool = False) -> None:
        """Subscribe to a topic; unless `from_any_node`, messages of other nodes than the simulator are forged."""

        def check_sender(message: Any) -> None:
            node = sender(message)
            if from_any_node or node == self._simulator:
                callback(message)
                return
            with self._lock:
                if len(self._forged) < MAX_TRIED:
                    line = f"tried to forge {topic} at {self.time:.2f} s (by {printable(node)})"
                    self._forged.setdefault((topic, node), line)

        self._subscribers.append(rospy.Subscriber(topic, kind, check_sender, queue_size=_QUEUE_SIZE, tcp_nodelay=True))

    @property
    def forged(self) -> list[str]:
        """A line for each topic of the simulator and each other node that has published on it."""
        with self._lock:
            return [*self._forged.values()]

    def is_connected(self) -> bool:
        """Return whether all topics of the simulator are connected; scripts may advertise theirs later."""
        return all(subscriber.get_num_connections() for subscriber in self._subscribers)

    def clear(self) -> None:
        with self._lock:
            self._forged: dict[tuple[str, str], str] = {}  # by topic and node
            self.went_back = False  # the time went back: another client has restarted the simulation
            self.time = 0.0  # s, the last stamp of odometry
            self._odometry: list[_Row] = []
            self._propellers: list[_Row] = []
            self._commands: dict[float, _Row] = {}
            self._contacts: dict[ContactEvent, None] = {}
            self._values: dict[str, list[ValueChange]] = {}
            self._other_poses: dict[str, dict[float, _Row]] = {}

    def _on_odometry(self, message: Odometry) -> None:
        row = (_stamp(message), *odometry_row(message))
        with self._lock:
            self.went_back = self.went_back or 0.0 < row[0] < self.time  # 0 while the simulation is stopped
            self.time = max(self.time, row[0])
            self._odometry.append(row)
        if row[0]:  # 0 before the first step
            self._after_step(row[0])

    def _on_command(self, message: TwistStamped) -> None:
        twist = message.twist
        with self._lock:
            self._commands[_stamp(message)] = (*xyz(twist.linear), twist.angular.z)

    def _on_propellers(self, message: Float32MultiArray) -> None:
        with self._lock:
            self._propellers.append(tuple(message.data)[:4])

    def _on_other_odometry(self, name: str, message: Odometry) -> None:
        with self._lock:
            self._other_poses.setdefault(name, {})[_stamp(message)] = odometry_row(message)[:7]

    def _on_contacts(self, message: MarkerArray) -> None:
        with self._lock:
            for marker in message.markers:
                self._contacts[ContactEvent(_stamp(marker), marker.ns)] = None

    def _on_signals(self, message: String) -> None:
        content = json.loads(message.data)
        with self._lock:
            for name in self._signals:
                changes, value = self._values.setdefault(name, []), content["signals"].get(name)
                if (changes[-1].value if changes else None) != value:
                    changes.append(ValueChange(content["time"], value))

    def _add_value(self, name: str, value: Any) -> None:
        with self._lock:
            self._values.setdefault(name, []).append(ValueChange(self.time, value))

    def find_topics(self) -> None:
        """Subscribe to the needed topics of scripts and other nodes that have been advertised since the last call."""
        for plan_name, topic in list(self._topics.items()):
            kind, name, _ = rostopic.get_topic_class(topic)
            if kind is not None:
                del self._topics[plan_name]
                self._subscribe(name, kind, partial(self._add_value, plan_name), from_any_node=True)

    def record(self, duration: float) -> FlightRecord | None:
        """Return the flight so far, `duration` seconds at most; None if no odometry has been received."""
        with self._lock:
            rows = self._rows()
            if not rows:
                return None
            table = np.array([row for row in rows if row[0] <= duration + 1e-6])
            poses = {name: _poses_at(table[:, 0], some) for name, some in self._other_poses.items()}
            values = {name: tuple(changes) for name, changes in self._values.items()}
            contacts = tuple(sorted(self._contacts))
        return FlightRecord(table, bool(table[-1, 0] >= duration - 1e-6), contacts, values.get("", ()), values, poses)

    def _rows(self) -> list[_Row]:
        """Return the table; odometry and propellers are aligned at their last messages, which are of the same step."""
        pairs = min(len(self._odometry), len(self._propellers))
        propellers = [(0.0,) * 4] * (len(self._odometry) - pairs) + self._propellers[len(self._propellers) - pairs :]
        rows: dict[float, _Row] = {}
        command: _Row = (0.0,) * 4
        for state, velocities in zip(self._odometry, propellers):
            command = self._commands.get(state[0], command)
            rows[state[0]] = (*state, *command, *velocities)  # the last of equal stamps
        return [rows[stamp] for stamp in sorted(rows)]


def _poses_at(times: np.ndarray, poses: dict[float, _Row]) -> np.ndarray:
    """Return the last pose at or before each time (s), (N, 7)."""
    stamps = np.array(sorted(poses))
    index = np.clip(np.searchsorted(stamps, times + 1e-6, "right") - 1, 0, None)
    return np.array([poses[stamp] for stamp in stamps[index]])


def _stamp(message: Any) -> float:
    return float(round(message.header.stamp.to_sec(), 6))


class LiveRules:
    """Listens to the simulator's `interventions` (docs/interface.md) for those that the plan does not allow."""

    def __init__(self, plan: Plan, simulator: str):
        """Subscribe to the interventions of the node `simulator`."""
        self._allowed, self._calls = {*plan.allowed}, {*plan.calls}
        self.tried: list[str] = []
        topic = f"{simulator}/interventions"
        self._subscriber = rospy.Subscriber(topic, String, self._on_intervention, queue_size=_QUEUE_SIZE)

    def is_connected(self) -> bool:
        return bool(self._subscriber.get_num_connections())

    def clear(self) -> None:
        """Discard the interventions before the flight."""
        self.tried = []

    def _on_intervention(self, message: String) -> None:
        line: str = message.data
        action, subject, *_ = [*line.split(" ", 2), ""]
        is_own = line.endswith(f", by {rospy.get_name()})")
        is_allowed = subject in self._calls if action == CALL else action in self._allowed
        if not is_own and not is_allowed and len(self.tried) < MAX_TRIED:
            self.tried.append(f"tried to {line}")
