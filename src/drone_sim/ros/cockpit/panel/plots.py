"""What a vehicle does against what it is told, over the last half minute."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32MultiArray

from drone_sim.mechanics import frames
from drone_sim.ros.cockpit.panel.chart import EVERY, add_chart

_KEPT = 600  # steps: half a minute
_UNKNOWN = (math.nan,) * 4  # a gap in the chart
_CHARTS = {
    "velocity in the track frame, m/s": ("commanded vx", "vx", "commanded vy", "vy"),
    "height, m": ("z",),
    "attitude, rad": ("roll", "pitch", "yaw"),
    # The tutorial's thrust is what all four have in common.
    "propellers and thrust, m/s": ("front left", "back left", "back right", "front right", "thrust"),
}


class Plots:
    """Charts of one vehicle's topics."""

    def __init__(self, gui: Any):
        """Draw empty charts."""
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_KEPT)
        self._command, self._propellers = (0.0, 0.0), _UNKNOWN
        self._vehicle = ""
        self._listening: list[rospy.Subscriber] = []
        self._ticks = 0
        self._charts = [add_chart(gui, title, names) for title, names in _CHARTS.items()]

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
        self._propellers = tuple(message.data)

    def _on_odometry(self, message: Odometry) -> None:
        at, turn, linear = message.pose.pose.position, message.pose.pose.orientation, message.twist.twist.linear
        matrix = frames.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
        roll, pitch, yaw = frames.to_rpy(matrix)
        level = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -yaw))
        vx, vy, _ = frames.rotate(level, frames.rotate(matrix, (linear.x, linear.y, linear.z)))
        (command_x, command_y), time = self._command, message.header.stamp.to_sec()
        row = (time, command_x, vx, command_y, vy, at.z, roll, pitch, yaw, *self._propellers, sum(self._propellers) / 4)
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
        for chart, names in zip(self._charts, _CHARTS.values()):
            chart.data = (columns[0] - columns[0][-1], *columns[first : first + len(names)])
            first += len(names)
