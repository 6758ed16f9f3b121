"""Charts of the last half minute: what a vehicle does against what it is told, and one of its sensors."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32MultiArray

from drone_sim.ros.cockpit.topics import PLOTTED, PlottedMessage
from drone_sim.ros.core.message_conversion import level_motion, odometry_row

_STEPS = 600  # half a minute
_UNKNOWN = (math.nan,) * 4  # a gap in the chart
_CHARTS = {  # lines, and what the axis shows at least
    "velocity in the track frame, m/s": (("commanded vx", "vx", "commanded vy", "vy"), (-0.2, 0.2)),
    "height, m": (("z",), (0.0, 1.0)),
    "attitude, rad": (("roll", "pitch", "yaw"), (-0.1, 0.1)),
    # The tutorial's thrust is what all four have in common.
    "propellers and thrust, m/s": (("front left", "back left", "back right", "front right", "thrust"), (0.0, 6.0)),
}
_NONE = "none"
_SECONDS, _DRAWN = 30.0, 600  # s, and at most so many points of them
_MOST = 100_000  # messages that are kept, however fast they come
EVERY = 10  # ticks between two drawings, each of which sends up to 70 kB
_COLORS = ("#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf")


class VehiclePlots:
    """Charts of one vehicle's topics."""

    def __init__(self, gui: Any):
        """Draw empty charts into `gui`."""
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_STEPS)
        self._command, self._propellers = (0.0, 0.0), _UNKNOWN
        self._vehicle = ""
        self._listening: list[rospy.Subscriber] = []
        self._ticks = 0
        self._charts = [add_chart(gui, title, names, least) for title, (names, least) in _CHARTS.items()]

    def follow(self, vehicle: str) -> None:
        """Listen to a vehicle, '' for none."""
        if vehicle == self._vehicle:
            return
        for one in self._listening:
            one.unregister()
        self._vehicle, self._listening = vehicle, []
        self._command, self._propellers = (0.0, 0.0), _UNKNOWN
        with self._lock:
            self._rows.clear()
        if vehicle:
            self._listening = [
                rospy.Subscriber(f"/{vehicle}/command", TwistStamped, self._on_command, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/propellers", Float32MultiArray, self._on_propellers, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/odom", Odometry, self._on_odometry, queue_size=5),
            ]

    def _on_command(self, message: TwistStamped) -> None:
        self._command = message.twist.linear.x, message.twist.linear.y

    def _on_propellers(self, message: Float32MultiArray) -> None:
        self._propellers = tuple(message.data)[:4]

    def _on_odometry(self, message: Odometry) -> None:
        position, rpy, (vx, vy, _) = level_motion(odometry_row(message))
        (command_x, command_y), time = self._command, message.header.stamp.to_sec()
        row = (time, command_x, vx, command_y, vy, position[2], *rpy, *self._propellers, sum(self._propellers) / 4)
        with self._lock:
            if self._rows and time <= self._rows[-1][0]:
                self._rows.clear()  # another run
            self._rows.append(row)

    def show(self) -> None:
        """Draw what has come, twice a second."""
        self._ticks += 1
        if self._ticks % EVERY:
            return
        with self._lock:
            columns = np.array(self._rows).T
        if len(columns) == 0 or columns.shape[1] < 2:
            return
        first = 1
        for chart, (names, _) in zip(self._charts, _CHARTS.values()):
            chart.data = (columns[0] - columns[0][-1], *columns[first : first + len(names)])
            first += len(names)


class SensorPlot:
    """A list of sensors, and the chart of the one that is chosen."""

    def __init__(self, gui: Any):
        """Draw the list into `gui`, without a chart."""
        self._gui = gui
        self._folder = gui.add_folder("Sensor")
        with self._folder:
            self._selection = gui.add_dropdown("Topic", (_NONE,))
        self._kinds: Mapping[str, str] = {}
        self._shown = (_NONE, "")  # topic and type
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_MOST)
        self._chart: Any = None
        self._subscriber: rospy.Subscriber | None = None
        self._ticks = 0

    def offer(self, sensors: Mapping[str, str]) -> None:
        """Offer these topics, given with their types."""
        self._kinds = sensors
        chosen = self._selection.value if self._selection.value in sensors else _NONE
        if set_options(self._selection, (_NONE, *sensors)):
            self._selection.value = chosen

    def show(self, listening: bool = True) -> None:
        """Draw what has come, twice a second; hear nothing unless `listening`."""
        topic = self._selection.value if listening else _NONE
        wanted = (topic, self._kinds.get(topic, ""))
        if wanted != self._shown:
            self._follow(*wanted)
        self._ticks += 1
        if self._chart is None or self._ticks % EVERY:
            return
        with self._lock:
            rows = list(self._rows)
        if len(rows) > 1:
            columns = np.array(rows[:: -(-len(rows) // _DRAWN)]).T
            self._chart.data = (columns[0] - rows[-1][0], *columns[1:])

    def _follow(self, topic: str, kind: str) -> None:
        if self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None
        if self._chart is not None:
            self._chart.remove()
            self._chart = None
        with self._lock:
            self._rows.clear()
        self._shown = (topic, kind)
        reading = PLOTTED.get(kind)
        if reading is not None:
            with self._folder:
                self._chart = add_chart(self._gui, topic, reading.names)
            self._subscriber = rospy.Subscriber(topic, reading.message, self._on_message, reading)

    def _on_message(self, message: Any, reading: PlottedMessage) -> None:
        time = message.header.stamp.to_sec()
        with self._lock:
            if self._rows and time < self._rows[-1][0]:
                self._rows.clear()  # another run
            self._rows.append((time, *reading.numbers(message)))
            while self._rows[0][0] < time - _SECONDS:
                self._rows.popleft()


def set_options(dropdown: Any, options: tuple[str, ...]) -> bool:
    """Offer these, and tell whether they are others than before: browsers are not sent the same again."""
    is_news = tuple(dropdown.options) != options
    if is_news:
        dropdown.options = options
    return is_news


def add_chart(gui: Any, title: str, names: tuple[str, ...], least: tuple[float, float] | None = None) -> Any:
    """Draw an empty chart with a line for each name; its `data` are the times (s) and each line's values.

    Its axis shows `least`: what is all zero would have one from 0 to 100.
    """
    empty = tuple(np.array([0.0, 1.0]) for _ in range(len(names) + 1))
    lines = [{"label": name, "stroke": color, "width": 1.5} for name, color in zip(names, _COLORS)]
    scales: dict[str, Any] = {"x": {"time": False, "auto": True}, "y": {"auto": True}}
    if least is not None:
        scales["y"]["range"] = {end: {"pad": 0.1, "soft": at, "mode": 1} for end, at in zip(("min", "max"), least)}
    return gui.add_uplot(empty, ({"label": "t, s"}, *lines), title=title, height=150, scales=scales)
