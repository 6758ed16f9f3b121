"""Numbers of the last half minute, which the page draws: what a vehicle does, its sensors, what scripts signal."""

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

_SECONDS = 30.0  # that are kept
_CLOSEST = 0.02  # s between two rows that are kept, however fast a sensor is
_PATIENCE = 5.0  # s after which a sensor that nobody has asked about is heard no more
_MOST = 100  # charts that one question may name
_LONGEST = 1 << 20  # characters of a message with signals
_UNKNOWN = (math.nan,) * 4  # a gap in the chart
SIGNAL = "signal "  # what the name of a signal's chart begins with


class Chart(NamedTuple):
    """A title, a unit ('' for none), a name for each line, what its axis shows at least, and which columns it draws."""

    title: str
    unit: str
    lines: Sequence[str]
    least: tuple[float, float] | None = None
    columns: slice = slice(None)


_OF_THE_VEHICLE = {
    "velocity": Chart(
        "Velocity",
        "m/s",
        ("forward, commanded", "forward", "sideways, commanded", "sideways"),
        (-0.2, 0.2),
        slice(0, 4),
    ),
    "height": Chart("Height", "m", ("height",), (0.0, 1.0), slice(4, 5)),
    "attitude": Chart("Attitude", "rad", ("roll", "pitch", "yaw"), (-0.1, 0.1), slice(5, 8)),
    # The tutorial's thrust is what all four have in common.
    "propellers": Chart(
        "Propellers and thrust",
        "m/s",
        ("front left", "back left", "back right", "front right", "thrust"),
        (0.0, 6.0),
        slice(8, 13),
    ),
}


class Series:
    """Rows of numbers by time (s); when that goes back, another run begins."""

    def __init__(self) -> None:
        """Begin empty."""
        self.run = 0
        self._rows: deque[tuple[float, ...]] = deque()

    def add(self, at: float, values: Sequence[float]) -> None:
        """Add a row, unless it comes too soon after the last one."""
        if self._rows and at < self._rows[-1][0]:
            self._rows.clear()
            self.run += 1
        if self._rows and at - self._rows[-1][0] < _CLOSEST:
            return
        self._rows.append((at, *values))
        while self._rows[0][0] < at - _SECONDS:
            self._rows.popleft()

    def since(self, run: int, at: float, columns: slice) -> list[list[float | None]]:
        """Return the rows after the time `at`, or all rows if `run` is not the present run; None is a gap."""
        known = at if run == self.run else -math.inf
        return [
            [row[0], *(one if math.isfinite(one) else None for one in row[1:][columns])]
            for row in self._rows
            if row[0] > known
        ]


class Plots:
    """Keeps what a vehicle does and what scripts signal; hears a sensor while a browser asks about it."""

    def __init__(self, board: Board, clock: Callable[[], float] = time.monotonic):
        """Show on `board` which charts there are; `clock` returns s."""
        self._board, self._clock = board, clock
        self._lock = threading.Lock()
        self._charts: dict[str, tuple[str, Chart]] = {}  # by name: key of its series, and what it draws
        self._series: dict[str, Series] = {}  # by topic, '' is the vehicle's, or by the name of a signal
        self._sensors: dict[str, tuple[rospy.Subscriber, float]] = {}  # by topic, and when somebody asked last
        self._kinds: Mapping[str, str] = {}
        self._signals: dict[str, float] = {}
        self._command, self._propellers = (0.0, 0.0), _UNKNOWN
        self._vehicle = ""
        self._listening: list[rospy.Subscriber] = []

    def follow(self, vehicle: str) -> None:
        """Listen to a vehicle, '' for none."""
        if vehicle == self._vehicle:
            return
        for one in self._listening:
            one.unregister()
        self._vehicle, self._listening = vehicle, []
        with self._lock:
            self._command, self._propellers = (0.0, 0.0), _UNKNOWN
            self._series.pop("", None)
        self._offer()
        if vehicle:
            self._listening = [
                rospy.Subscriber(f"/{vehicle}/command", TwistStamped, self._on_command, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/propellers", Float32MultiArray, self._on_propellers, queue_size=5),
                rospy.Subscriber(f"/{vehicle}/odom", Odometry, self._on_odometry, queue_size=5),
            ]

    def offer(self, sensors: Mapping[str, str]) -> None:
        """Offer these topics of sensors, given with their types."""
        if sensors != self._kinds:
            self._kinds = dict(sensors)
            self._offer()

    def rest(self) -> None:
        """Hear no sensor about which nobody has asked for a while."""
        with self._lock:
            old = [name for name, (_, asked) in self._sensors.items() if self._clock() - asked > _PATIENCE]
            for name in old:
                self._sensors.pop(name)[0].unregister()
                self._series.pop(name, None)

    def _offer(self) -> None:
        charts = {name: ("", chart) for name, chart in _OF_THE_VEHICLE.items()} if self._vehicle else {}
        for topic, kind in self._kinds.items():
            charts.update({f"{topic} {one.title}": (topic, one) for one in _of_sensor(topic, kind, self._vehicle)})
        charts.update({f"{SIGNAL}{name}": (f"{SIGNAL}{name}", Chart(name, "", (name,))) for name in self._signals})
        with self._lock:
            self._charts = charts
        self._board.show(
            "charts",
            [
                {"chart": name, "title": one.title, "unit": one.unit, "lines": list(one.lines), "least": one.least}
                for name, (_, one) in charts.items()
            ],
        )

    # ---- what comes

    def _on_command(self, message: TwistStamped) -> None:
        self._command = message.twist.linear.x, message.twist.linear.y

    def _on_propellers(self, message: Float32MultiArray) -> None:
        self._propellers = tuple(message.data)[:4]

    def _on_odometry(self, message: Odometry) -> None:
        position, rpy, (vx, vy, _) = level_motion(odometry_row(message))
        (x, y), four = self._command, self._propellers
        row = x, vx, y, vy, position[2], *rpy, *four, sum(four) / 4
        self._add("", message.header.stamp.to_sec(), row)

    def _on_sensor(self, message: Any, topic: str) -> None:
        self._add(topic, message.header.stamp.to_sec(), PLOTTED[message._type].numbers(message))

    def on_signals(self, message: String) -> None:
        """Take what the node says of signals: JSON of the time (s) and of numbers by name."""
        try:
            said = json.loads(message.data) if len(message.data) <= _LONGEST else {}
            at, signals = float(said["time"]), {str(name): float(one) for name, one in said["signals"].items()}
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return
        for name, value in signals.items():
            self._add(f"{SIGNAL}{name}", at, (value,))
        if signals.keys() != self._signals.keys():
            self._signals = signals
            self._offer()

    def _add(self, key: str, at: float, row: Sequence[float]) -> None:
        with self._lock:
            self._series.setdefault(key, Series()).add(at, row)

    # ---- what a browser asks

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is new in the charts that are named, each with the run and the time (s) that a browser has."""
        asked = message.get("charts")
        if not isinstance(asked, Mapping) or len(asked) > _MOST or not all(map(_is_known, asked.values())):
            raise ValueError(
                f"charts = {shown(asked)}: must be a mapping of names to [run, time], with at most {_MOST} charts"
            )
        return {"charts": {name: self._since(name, int(run), at) for name, (run, at) in asked.items()}}

    def _since(self, name: str, run: int, at: float) -> dict[str, Any]:
        with self._lock:
            if name not in self._charts:
                return {"run": run, "rows": []}
            key, chart = self._charts[name]
            if key in self._kinds:
                self._hear(key)
            series = self._series.setdefault(key, Series())
            return {"run": series.run, "rows": series.since(run, at, chart.columns)}

    def _hear(self, topic: str) -> None:
        heard = self._sensors.get(topic)
        kind = PLOTTED[self._kinds[topic]].message
        subscriber = heard[0] if heard else rospy.Subscriber(topic, kind, self._on_sensor, topic)
        self._sensors[topic] = subscriber, self._clock()


def _is_known(one: Any) -> bool:
    return isinstance(one, list) and len(one) == 2 and all(type(value) in (int, float) for value in one)


def _of_sensor(topic: str, kind: str, vehicle: str) -> list[Chart]:
    """Return the charts of a sensor: one for each unit of its numbers."""
    units: dict[str, list[int]] = {}
    names = [name.rpartition(", ") for name in PLOTTED[kind].names]
    for index, (_, _, unit) in enumerate(names):
        units.setdefault(unit, []).append(index)
    own = topic.removeprefix(f"/{vehicle}/").strip("/")
    charts = []
    for unit, indices in units.items():
        lines = [names[index][0] for index in indices]
        what = lines[0].rpartition(" ")[0] if len(lines) > 1 else lines[0]
        title = f"{own}: {what}" if len(units) > 1 else own
        charts.append(Chart(title, unit, lines, None, slice(indices[0], indices[-1] + 1)))
    return charts
