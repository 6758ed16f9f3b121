"""The student's host: flies a circle, watches the pictures, and for each line on stdin prints what it saw since.

That is a line of JSON: see `_Seen`. It ends with stdin.
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
_STEP = 1e-6  # rad/s, by which commands differ: so each is known when it comes back
_FRESH = 1.0  # s, the age at which a picture is called old
_BUFFER = 2**24  # bytes; rospy's own, 64 KiB, lets pictures get old in the socket


class _Seen:
    """Counts from one report to the next."""

    def __init__(self) -> None:
        self.ages: list[float] = []  # s, of pictures when they came
        self.round_trips: list[float] = []  # s, from a command to the topic `command` that shows it
        self.fresh = 0.0  # s since the epoch, when a picture that was not old came first; 0 for never
        self.echo = 0.0  # the same, of a command

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
        """Begin to fly and to watch."""
        self._seen = _Seen()
        self._sent: dict[float, float] = {}  # when, by the commanded turn
        self._commands = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/drone/command", TwistStamped, self._see_command, queue_size=100, tcp_nodelay=True)
        self._watch(CompressedImage)
        threading.Thread(target=self._fly, daemon=True).start()

    def _watch(self, kind: type) -> None:
        topic = "/drone/front/compressed" if kind is CompressedImage else "/drone/front"
        self._pictures = rospy.Subscriber(
            topic, kind, self._see_picture, queue_size=1, buff_size=_BUFFER, tcp_nodelay=True
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

    def _see_command(self, message: TwistStamped) -> None:
        sent = self._sent.pop(message.twist.angular.z, None)
        if sent is not None:
            took = time.time() - sent
            self._seen.round_trips.append(took)
            if took < _FRESH:
                self._seen.echo = self._seen.echo or time.time()

    def _see_picture(self, message: Any) -> None:
        age = time.time() - message.header.stamp.to_sec()
        self._seen.ages.append(age)
        if age < _FRESH:
            self._seen.fresh = self._seen.fresh or time.time()

    def answer(self, word: str) -> None:
        """Report, and begin anew; `raw` or `compressed` is what is watched from now on."""
        if word in ("raw", "compressed"):
            self._pictures.unregister()
            self._watch(Image if word == "raw" else CompressedImage)
        seen, self._seen = self._seen, _Seen()
        print(json.dumps(seen.report()), flush=True)


def _median_and_worst(values: list[float]) -> tuple[float, float]:
    return (statistics.median(values), max(values)) if values else (0.0, 0.0)


if __name__ == "__main__":
    sys.stdin.readline()  # the network is there
    rospy.init_node("student", disable_signals=True)
    student = Student()
    for line in sys.stdin:
        student.answer(line.strip())
