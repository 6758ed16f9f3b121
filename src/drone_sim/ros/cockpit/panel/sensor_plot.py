"""What a sensor says, over the last half minute; the one that is chosen is listened to."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import rospy

from drone_sim.ros.cockpit.panel.chart import EVERY, add_chart
from drone_sim.ros.cockpit.panel.readings import READINGS, Reading

_NONE = "none"
_KEPT, _DRAWN = 30.0, 600  # s, and at most so many points of them
_MOST = 100_000  # messages that are kept, however fast they come


class SensorPlot:
    """A list of sensors, and the chart of the one that is chosen."""

    def __init__(self, gui: Any):
        """Begin with none."""
        self._gui = gui
        self._folder = gui.add_folder("Sensor")
        with self._folder:
            self._choice = gui.add_dropdown("Topic", (_NONE,))
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
        topics = (_NONE, *sensors)
        if tuple(self._choice.options) != topics:
            chosen = self._choice.value if self._choice.value in topics else _NONE
            self._choice.options = topics
            self._choice.value = chosen

    def show(self, listening: bool = True) -> None:
        """Draw what has come, twice a second; hear nothing unless `listening`."""
        topic = self._choice.value if listening else _NONE
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
        reading = READINGS.get(kind)
        if reading is not None:
            with self._folder:
                self._chart = add_chart(self._gui, topic, reading.names)
            self._subscriber = rospy.Subscriber(topic, reading.message, self._hear, reading)

    def _hear(self, message: Any, reading: Reading) -> None:
        time = message.header.stamp.to_sec()
        with self._lock:
            if self._rows and time < self._rows[-1][0]:
                self._rows.clear()  # another run
            self._rows.append((time, *reading.numbers(message)))
            while self._rows[0][0] < time - _KEPT:
                self._rows.popleft()
