"""Node on the student's host: flies a circle, receives images, and prints a report for each line on stdin.

A report is a line of JSON about the time since the previous one: see `_Statistics`. The node ends with stdin.
"""

from __future__ import annotations

import json
import statistics
import sys
import threading
import time
from typing import Any

import rospy
from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import CompressedImage, Image

_RATE = 20.0  # Hz, of commands
_FORWARD, _TURN = 0.3, 0.5  # m/s, rad/s
_STEP = 1e-6  # rad/s, difference between two commands, which identifies their echoes
_FRESH = 1.0  # s, age from which an image counts as old
_BUFFER = 2**24  # bytes; with rospy's default, 64 KiB, images get old in the socket


class _Statistics:
    """Statistics since the previous report."""

    def __init__(self) -> None:
        self.ages: list[float] = []  # s, of images on arrival
        self.round_trips: list[float] = []  # s, from a command to the topic `command` that shows it
        self.fresh = 0.0  # s since the epoch, arrival of the first image that was not old; 0 for none
        self.echo = 0.0  # the same for commands

    def report(self) -> dict[str, Any]:
        return {
            "pictures": len(self.ages),
            "stale": sum(age > _FRESH for age in self.ages),
            "age": _median_and_worst(self.ages),
            "round_trip": _median_and_worst(self.round_trips),
            "fresh": self.fresh,
            "echo": self.echo,
        }


class Student:
    def __init__(self) -> None:
        """Start to fly and to receive images."""
        self._statistics = _Statistics()
        self._sent: dict[float, float] = {}  # time of publication by commanded turn rate
        self._commands = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/drone/command", TwistStamped, self._on_command, queue_size=100, tcp_nodelay=True)
        self._subscribe(CompressedImage)
        threading.Thread(target=self._fly, daemon=True).start()

    def _subscribe(self, kind: type) -> None:
        topic = "/drone/front/compressed" if kind is CompressedImage else "/drone/front"
        self._pictures = rospy.Subscriber(
            topic, kind, self._on_image, queue_size=1, buff_size=_BUFFER, tcp_nodelay=True
        )

    def _fly(self) -> None:
        command, number = Twist(), 0
        command.linear.x = _FORWARD
        while True:
            number += 1
            command.angular.z = _TURN + number * _STEP
            self._sent[command.angular.z] = time.time()
            self._commands.publish(command)
            time.sleep(1 / _RATE)

    def _on_command(self, message: TwistStamped) -> None:
        sent = self._sent.pop(message.twist.angular.z, None)
        if sent is not None:
            delay = time.time() - sent
            self._statistics.round_trips.append(delay)
            if delay < _FRESH:
                self._statistics.echo = self._statistics.echo or time.time()

    def _on_image(self, message: Any) -> None:
        age = time.time() - message.header.stamp.to_sec()
        self._statistics.ages.append(age)
        if age < _FRESH:
            self._statistics.fresh = self._statistics.fresh or time.time()

    def answer(self, word: str) -> None:
        """Print a report and start the next one; `raw` or `compressed` selects the kind of images from now on."""
        if word in ("raw", "compressed"):
            self._pictures.unregister()
            self._subscribe(Image if word == "raw" else CompressedImage)
        finished, self._statistics = self._statistics, _Statistics()
        print(json.dumps(finished.report()), flush=True)


def _median_and_worst(values: list[float]) -> tuple[float, float]:
    return (statistics.median(values), max(values)) if values else (0.0, 0.0)


if __name__ == "__main__":
    sys.stdin.readline()  # the network is ready
    rospy.init_node("student", disable_signals=True)
    student = Student()
    for line in sys.stdin:
        student.answer(line.strip())
