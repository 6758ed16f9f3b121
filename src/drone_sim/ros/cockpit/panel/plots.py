"""Values of the last half minute for the page's charts: a vehicle's motion, its sensors, and signals of scripts."""

from __future__ import annotations

import json
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32MultiArray, String

from drone_sim.message_text import shown
from drone_sim.ros.cockpit.panel.board import Board
from drone_sim.ros.cockpit.topics import PLOTTED
from drone_sim.ros.core.message_conversion import level_motion, odometry_row

_DURATION = 30.0  # s, of the stored rows
_MIN_PERIOD = 0.02  # s, between two stored rows
_SENSOR_TIMEOUT = 5.0  # s after the last request for a sensor, after which its topic is unsubscribed
_MAX_CHARTS = 100  # in one request
_MAX_LENGTH = 1 << 20  # characters of a message with signals
_UNKNOWN = (math.nan,) * 4  # a gap in the chart
SIGNAL = "signal "  # prefix of the names of signals' charts


class Chart(NamedTuple):
    """Title, unit ('' for none), names of the lines, smallest range of the axis, and columns of the series."""

    title: str
    unit: str
    lines: Sequence[str]
    least: tuple[float, float] | None = None
    columns: slice = slice(None)


_VEHICLE_CHARTS = {
    "velocity": Chart(
        "Velocity",
        "m/s",
        ("forward, commanded", "forward", "sideways, commanded", "sideways"),
        (-0.2, 0.2),
        slice(0, 4),
    ),
    "height": Chart("Height", "m", ("height",), (0.0, 1.0), slice(4, 5)),
    "attitude": Chart("Attitude", "rad", ("roll", "pitch", "yaw"), (-0.1, 0.1), slice(5, 8)),
    # The thrust, as in the tutorial, is the mean of the four propellers.
    "propellers": Chart(
        "Propellers and thrust",
        "m/s",
        ("front left", "back left", "back right", "front right", "thrust"),
        (0.0, 6.0),
        slice(8, 13),
    ),
}


class Series:
    """Rows of numbers by time (s). If time goes back, a new run begins."""

    def __init__(self) -> None:
        self.run = 0
        self._rows: deque[tuple[float, ...]] = deque()

    def add(self, at: float, values: Sequence[float]) -> None:
        """Add a row, unless it is less than _MIN_PERIOD after the last one."""
        if self._rows and at < self._rows[-1][0]:
            self._rows.clear()
            self.run += 1
        if self._rows and at - self._rows[-1][0] < _MIN_PERIOD:
            return
        self._rows.append((at, *values))
        while self._rows[0][0] < at - _DURATION:
            self._rows.popleft()

    def since(self, run: int, at: float, columns: slice) -> list[list[float | None]]:
        """Return the rows after the time `at`, or all rows if `run` is not the present run; None is a gap."""
        start = at if run == self.run else -math.inf
        return [
            [row[0], *(value if math.isfinite(value) else None for value in row[1:][columns])]
            for row in self._rows
            if row[0] > start
        ]


class Plots:
    """Series for the charts. A sensor's topic is subscribed while browsers request its charts."""

    def __init__(self, board: Board, clock: Callable[[], float] = time.monotonic):
        """`board` lists the charts; `clock` must be monotonic (s)."""
        self._board, self._clock = board, clock
        self._lock = threading.Lock()
        self._charts: dict[str, tuple[str, Chart]] = {}  # by name, with the key of its series
        self._series: dict[str, Series] = {}  # by topic, by the name of a signal's chart, or '' for the vehicle
        self._sensors: dict[str, tuple[rospy.Subscriber, float]] = {}  # by topic, with the time of the last request
        self._kinds: Mapping[str, str] = {}
        self._signals: dict[str, float] = {}
        self._command, self._propellers = (0.0, 0.0), _UNKNOWN
        self._vehicle = ""
        self._subscribers: list[rospy.Subscriber] = []

    def follow(self, vehicle: str) -> None:
        """Subscribe to a vehicle's topics, '' for none."""
        if vehicle == self._vehicle:
            return
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._vehicle, self._subscribers = vehicle, []
        with self._lock:
            self._command, self._propellers = (0.0, 0.0), _UNKNOWN
            self._series.pop("", None)
        self._update_charts()
        if vehicle:
            self._subscribers = [
                rospy.Subscriber(f"/{vehicle}/command", TwistStamped, self._on_command, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/propellers", Float32MultiArray, self._on_propellers, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/odom", Odometry, self._on_odometry, queue_size=5),
            ]

    def offer(self, sensors: Mapping[str, str]) -> None:
        """Set the topics of sensors, with their types."""
        if sensors != self._kinds:
            self._kinds = dict(sensors)
            self._update_charts()

    def rest(self) -> None:
        """Unsubscribe from sensors whose charts have not been requested for _SENSOR_TIMEOUT."""
        with self._lock:
            now = self._clock()
            for topic in [topic for topic, (_, last) in self._sensors.items() if now - last > _SENSOR_TIMEOUT]:
                self._sensors.pop(topic)[0].unregister()
                self._series.pop(topic, None)

    def _update_charts(self) -> None:
        charts = {name: ("", chart) for name, chart in _VEHICLE_CHARTS.items()} if self._vehicle else {}
        for topic, kind in self._kinds.items():
            of_sensor = _sensor_charts(topic, kind, self._vehicle)
            charts.update({f"{topic} {chart.title}": (topic, chart) for chart in of_sensor})
        charts.update({f"{SIGNAL}{name}": (f"{SIGNAL}{name}", Chart(name, "", (name,))) for name in self._signals})
        with self._lock:
            self._charts = charts
        listed = [
            {"chart": name, "title": chart.title, "unit": chart.unit, "lines": list(chart.lines), "least": chart.least}
            for name, (_, chart) in charts.items()
        ]
        self._board.show("charts", listed)

    # ---- messages

    def _on_command(self, message: TwistStamped) -> None:
        self._command = message.twist.linear.x, message.twist.linear.y

    def _on_propellers(self, message: Float32MultiArray) -> None:
        self._propellers = tuple(message.data)[:4]

    def _on_odometry(self, message: Odometry) -> None:
        position, rpy, (vx, vy, _) = level_motion(odometry_row(message))
        (x, y), propellers = self._command, self._propellers
        row = x, vx, y, vy, position[2], *rpy, *propellers, sum(propellers) / 4
        self._add("", message.header.stamp.to_sec(), row)

    def _on_sensor(self, message: Any, topic: str) -> None:
        self._add(topic, message.header.stamp.to_sec(), PLOTTED[message._type].numbers(message))

    def on_signals(self, message: String) -> None:
        """Add the node's signals, which are JSON of the time (s) and of numbers by name."""
        try:
            content = json.loads(message.data) if len(message.data) <= _MAX_LENGTH else {}
            at, signals = float(content["time"]), {str(name): float(x) for name, x in content["signals"].items()}
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return
        for name, value in signals.items():
            self._add(f"{SIGNAL}{name}", at, (value,))
        if signals.keys() != self._signals.keys():
            self._signals = signals
            self._update_charts()

    def _add(self, key: str, at: float, row: Sequence[float]) -> None:
        with self._lock:
            self._series.setdefault(key, Series()).add(at, row)

    # ---- requests

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Return the new rows of charts; the message has, by chart, run and time (s) of the browser's last row.

        Raises ValueError.
        """
        charts = message.get("charts")
        if (
            not isinstance(charts, Mapping)
            or len(charts) > _MAX_CHARTS
            or not all(map(_is_run_and_time, charts.values()))
        ):
            allowed = f"must be a mapping of names to [run, time], with at most {_MAX_CHARTS} charts"
            raise ValueError(f"charts = {shown(charts)}: {allowed}")
        return {"charts": {name: self._since(name, int(run), at) for name, (run, at) in charts.items()}}

    def _since(self, name: str, run: int, at: float) -> dict[str, Any]:
        with self._lock:
            if name not in self._charts:
                return {"run": run, "rows": []}
            key, chart = self._charts[name]
            if key in self._kinds:  # the topic of a sensor
                subscriber, _ = self._sensors.get(key, (None, 0.0))
                if subscriber is None:
                    subscriber = rospy.Subscriber(key, PLOTTED[self._kinds[key]].message, self._on_sensor, key)
                self._sensors[key] = subscriber, self._clock()
            series = self._series.setdefault(key, Series())
            return {"run": series.run, "rows": series.since(run, at, chart.columns)}


def _is_run_and_time(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(type(number) in (int, float) for number in value)


def _sensor_charts(topic: str, kind: str, vehicle: str) -> list[Chart]:
    """Return the charts of a sensor, one for each unit of its numbers."""
    units: dict[str, list[int]] = {}
    names = [name.rpartition(", ") for name in PLOTTED[kind].names]
    for index, (_, _, unit) in enumerate(names):
        units.setdefault(unit, []).append(index)
    own = topic.removeprefix(f"/{vehicle}/").strip("/")
    charts = []
    for unit, indices in units.items():
        lines = [names[index][0] for index in indices]
        quantity = lines[0].rpartition(" ")[0] if len(lines) > 1 else lines[0]
        title = f"{own}: {quantity}" if len(units) > 1 else own
        charts.append(Chart(title, unit, lines, None, slice(indices[0], indices[-1] + 1)))
    return charts
