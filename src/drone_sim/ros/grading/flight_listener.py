"""A flight as its topics tell of it."""

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
from drone_sim.grading.permissions import MOST_TRIED
from drone_sim.grading.plan import Plan
from drone_sim.message_text import printable
from drone_sim.ros.core.message_conversion import odometry_row, xyz
from drone_sim.ros.core.validation import sender
from drone_sim.ros.grading.simulator import Mismatch
from drone_sim.run.parameters import Parameters

_QUEUE = 1000  # messages; a flight that is graded loses none
_Row = tuple[float, ...]


class FlightListener:
    """Keeps the rows of the graded vehicle, and of others and beside them only what a criterion asks for.

    The time of what has no stamp (flight state, a script's topics) is that of the last odometry.
    """

    def __init__(self, plan: Plan, parameters: Parameters, simulator: str, follow: Callable[[float], None]):
        """Subscribe to what `plan` asks for of the node `simulator` and the vehicles in `parameters`. Raises Mismatch.

        `follow` is called with the time (s) of each step, after it.
        """
        self._follow, self._simulator = follow, simulator
        self._lock = threading.Lock()
        self._subscribers: list[rospy.Subscriber] = []
        self._vehicle = plan.vehicle_of(parameters)
        self.clear()
        self._subscribe(f"/{self._vehicle}/odom", Odometry, self._on_odometry)
        self._subscribe(f"/{self._vehicle}/command", TwistStamped, self._on_command)
        self._subscribe(f"/{self._vehicle}/propellers", Float32MultiArray, self._on_propellers)
        self._subscribe_for_criteria(plan, parameters)
        self._signals = {name for one in plan.criteria for name in one.signals}
        if self._signals:
            self._subscribe(f"{simulator}/signals", String, self._on_signals)

    def _subscribe_for_criteria(self, plan: Plan, parameters: Parameters) -> None:
        names = [one.name for one in parameters.fleet]
        self._topics: dict[str, str] = {}  # those of a kind that is not known yet, by the plan's names
        for one in plan.criteria:
            if one.signals and not isinstance(getattr(one, "equals", 0), (int, float)):
                _refuse(one.called, one.signals, "of signals numbers alone are heard; let the script publish others")
            away = [*(other for other in one.others if other not in names), *one.lines]
            _refuse(one.called, away, "objects have no topic")
            for other in one.others:
                self._subscribe(f"/{other}/odom", Odometry, partial(self._on_other, other))
            if one.needs_contacts:
                self._subscribe(self._contacts(one.called, parameters), MarkerArray, self._on_contacts)
            if one.needs_states:
                self._subscribe(f"/{self._vehicle}/state", String, lambda message: self._say("", message.data))
        self._topics = plan.topics_of(parameters)

    def _contacts(self, criterion: str, parameters: Parameters) -> str:
        """Return the topic of what the vehicle touches. Raises Mismatch."""
        own = next(one for one in parameters.fleet if one.name == self._vehicle)
        for sensor in own.sensors.values():
            if sensor.kind == "contacts":
                return f"/{self._vehicle}/{sensor.topic}"
        said = (
            "needs the sensor `contacts`, such as that of config/sensors.yaml, in the plan's config and the simulator's"
        )
        raise Mismatch(f"criterion {criterion}: {said}")

    def _subscribe(self, topic: str, kind: type, take: Callable[[Any], None], anybodys: bool = False) -> None:
        """Hear a topic; messages of other nodes than the simulator are forged, unless the topic is anybody's."""

        def hear(message: Any) -> None:
            by = sender(message)
            if anybodys or by == self._simulator:
                take(message)
                return
            with self._lock:
                if len(self._forged) < MOST_TRIED:
                    said = f"tried to forge {topic} at {self.time:.2f} s (by {printable(by)})"
                    self._forged.setdefault((topic, by), said)

        self._subscribers.append(rospy.Subscriber(topic, kind, hear, queue_size=_QUEUE, tcp_nodelay=True))

    @property
    def forged(self) -> list[str]:
        """What other nodes have published as if they were the simulator: a line for each topic and node."""
        with self._lock:
            return [*self._forged.values()]

    def is_connected(self) -> bool:
        """Whether everything that has to be there is heard. A script's own topics may come later."""
        return all(one.get_num_connections() for one in self._subscribers)

    def clear(self) -> None:
        """Forget what has been heard."""
        with self._lock:
            self._forged: dict[tuple[str, str], str] = {}  # by topic and node
            self.went_back = False  # somebody has started the simulation anew
            self.time = 0.0  # s, the latest stamp of odometry
            self._odometry: list[_Row] = []
            self._propellers: list[_Row] = []
            self._commands: dict[float, _Row] = {}
            self._touches: dict[ContactEvent, None] = {}
            self._said: dict[str, list[ValueChange]] = {}
            self._others: dict[str, dict[float, _Row]] = {}

    # ---- callbacks

    def _on_odometry(self, message: Odometry) -> None:
        row = (_stamp(message), *odometry_row(message))
        with self._lock:
            self.went_back = self.went_back or 0.0 < row[0] < self.time  # stopped, it is at 0
            self.time = max(self.time, row[0])
            self._odometry.append(row)
        if row[0]:  # before the first step nothing has been flown
            self._follow(row[0])

    def _on_command(self, message: TwistStamped) -> None:
        twist = message.twist
        with self._lock:
            self._commands[_stamp(message)] = (*xyz(twist.linear), twist.angular.z)

    def _on_propellers(self, message: Float32MultiArray) -> None:
        with self._lock:
            self._propellers.append(tuple(message.data)[:4])

    def _on_other(self, name: str, message: Odometry) -> None:
        with self._lock:
            self._others.setdefault(name, {})[_stamp(message)] = odometry_row(message)[:7]

    def _on_contacts(self, message: MarkerArray) -> None:
        with self._lock:
            for marker in message.markers:
                self._touches[ContactEvent(_stamp(marker), marker.ns)] = None

    def _on_signals(self, message: String) -> None:
        said = json.loads(message.data)
        with self._lock:
            for name in self._signals:
                values, value = self._said.setdefault(name, []), said["signals"].get(name)
                if (values[-1].value if values else None) != value:
                    values.append(ValueChange(said["time"], value))

    def _say(self, name: str, value: Any) -> None:
        with self._lock:
            self._said.setdefault(name, []).append(ValueChange(self.time, value))

    def look_for_topics(self) -> None:
        """Subscribe to those topics of scripts and nodes that are asked for and exist by now."""
        for called, topic in list(self._topics.items()):
            kind, name, _ = rostopic.get_topic_class(topic)
            if kind is not None:
                del self._topics[called]
                self._subscribe(name, kind, partial(self._say, called), anybodys=True)

    # ---- the flight

    def flown(self, duration: float) -> FlightRecord | None:
        """Return the flight so far; None where nothing has been heard of it."""
        with self._lock:
            rows = self._rows()
            if not rows:
                return None
            table = np.array([row for row in rows if row[0] <= duration + 1e-6])
            others = {name: _held(table[:, 0], poses) for name, poses in self._others.items()}
            said = {name: tuple(values) for name, values in self._said.items()}
            touches = tuple(sorted(self._touches))
        return FlightRecord(table, bool(table[-1, 0] >= duration - 1e-6), touches, said.get("", ()), said, others)

    def _rows(self) -> list[_Row]:
        """Return the table. Odometry and propellers are paired from the end: the last ones are of the same step."""
        pairs = min(len(self._odometry), len(self._propellers))
        propellers = [(0.0,) * 4] * (len(self._odometry) - pairs) + self._propellers[len(self._propellers) - pairs :]
        rows: dict[float, _Row] = {}
        command: _Row = (0.0,) * 4
        for state, velocities in zip(self._odometry, propellers):
            command = self._commands.get(state[0], command)
            rows[state[0]] = (*state, *command, *velocities)  # of one stamp the last
        return [rows[stamp] for stamp in sorted(rows)]


def _refuse(criterion: str, asked: Any, why: str) -> None:
    if asked:
        raise Mismatch(f"criterion {criterion}: asks for {', '.join(asked)}: {why}")


def _held(times: np.ndarray, poses: dict[float, _Row]) -> np.ndarray:
    """Return the pose at each time (s), or the last before it, (N, 7)."""
    stamps = np.array(sorted(poses))
    index = np.clip(np.searchsorted(stamps, times + 1e-6, "right") - 1, 0, None)
    return np.array([poses[stamp] for stamp in stamps[index]])


def _stamp(message: Any) -> float:
    return float(round(message.header.stamp.to_sec(), 6))
