"""Fly from the keyboard: the keys of the tutorial's teleop node, and height, stop, and a read-out.

A command holds until the next key, as on the topic. Leaving in any way sends a stop.
"""

from __future__ import annotations

import curses
import math
import os
import signal
import sys
from typing import Any, List, NamedTuple, Optional

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from drone_sim.ros.starting import init_node, reported

_STEP = 0.1  # m/s, per key press
_TURN_STEP = 0.2  # rad/s, per key press
_PERIOD = 0.1  # s between read-outs
_ESCAPE = 27

HELP = (
    "UP / DOWN     forward / backward",
    "LEFT / RIGHT  left / right",
    "e / r         turn left / right",
    "u / d         up / down",
    "space         stop",
    "ESC, q        stop and leave",
)


class Command(NamedTuple):
    """Speeds forward, left and up (m/s), and turning left (rad/s)."""

    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    wz: float = 0.0

    def after(self, key: int) -> Command:
        """Return the command after a key press; a key without a meaning changes nothing."""
        if key not in _KEYS:
            return self
        changed = (round(old + change, 6) for old, change in zip(self, _KEYS[key]))
        return Command(*changed) if key != ord(" ") else Command()

    def message(self) -> Twist:
        """Return it as a message."""
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z = self
        return twist


_KEYS = {
    curses.KEY_UP: (_STEP, 0, 0, 0),
    curses.KEY_DOWN: (-_STEP, 0, 0, 0),
    curses.KEY_LEFT: (0, _STEP, 0, 0),
    curses.KEY_RIGHT: (0, -_STEP, 0, 0),
    ord("u"): (0, 0, _STEP, 0),
    ord("d"): (0, 0, -_STEP, 0),
    ord("e"): (0, 0, 0, _TURN_STEP),
    ord("r"): (0, 0, 0, -_TURN_STEP),
    ord(" "): (0, 0, 0, 0),
}


class Teleop:
    """The node behind the keys."""

    def __init__(self) -> None:
        """Publish `<drone>/cmd_vel`, follow `<drone>/odom`; the private parameter `drone` names it."""
        self.command = Command()
        self._odometry: Optional[Odometry] = None
        drone = rospy.get_param("~drone", "drone")
        self._publisher = rospy.Publisher(f"{drone}/cmd_vel", Twist, queue_size=1)
        rospy.Subscriber(f"{drone}/odom", Odometry, self._keep, queue_size=1)

    def _keep(self, message: Odometry) -> None:
        self._odometry = message

    def press(self, key: int) -> None:
        """Take a key and publish the command that follows."""
        self.command = self.command.after(key)
        self._publisher.publish(self.command.message())

    def stop(self) -> None:
        """Publish a zero command."""
        self.press(ord(" "))

    def lines(self) -> List[str]:
        """Return the read-out: who listens, command, pose."""
        topic = self._publisher.resolved_name
        heard = "" if self._publisher.get_num_connections() else "   (nobody listens yet)"
        command = "vx {:+.1f}  vy {:+.1f}  vz {:+.1f} m/s   wz {:+.1f} rad/s".format(*self.command)
        return [f"{topic}{heard}", f"command  {command}", f"drone    {self._pose()}"]

    def _pose(self) -> str:
        if self._odometry is None:
            return "no odometry yet"
        pose = self._odometry.pose.pose
        q = pose.orientation
        yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        place = pose.position
        return f"x {place.x:+.2f}  y {place.y:+.2f}  z {place.z:+.2f} m   yaw {math.degrees(yaw):+.0f} deg"


def _draw(screen: Any, lines: List[str]) -> None:
    screen.erase()
    height, width = screen.getmaxyx()
    for row, line in enumerate(lines[:height]):
        screen.addnstr(row, 0, line, width - 1)
    screen.refresh()


def _fly(screen: Any) -> None:
    screen.timeout(int(_PERIOD * 1000))  # getch returns -1 after this long: the read-out stays live
    teleop = Teleop()
    try:
        while not rospy.is_shutdown():
            _draw(screen, [*HELP, "", *teleop.lines()])
            key = screen.getch()
            if key in (_ESCAPE, ord("q")):
                return
            if key in _KEYS:
                teleop.press(key)
    except KeyboardInterrupt:
        return
    finally:
        teleop.stop()
        # The message leaves in rospy's own time; a node that is gone delivers nothing.
        curses.napms(200)


def main() -> int:
    """Run the node until ESC, q, Ctrl-C, or the terminal closes; return its exit status."""
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        print("key_teleop: needs a terminal to read keys from", file=sys.stderr)
        return 1
    # rospy's own handlers would close the topics before the last stop is sent.
    if not init_node("key_teleop", anonymous=True, disable_signals=True):
        return 1
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    os.environ.setdefault("ESCDELAY", "25")  # ms; curses waits a second for what may follow an ESC
    status = reported("key_teleop", lambda: curses.wrapper(_fly))
    rospy.signal_shutdown("left")
    return status
