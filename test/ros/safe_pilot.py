#!/usr/bin/env python3
"""A node that flies like a teleoperation node of a real drone: reset, 1 s, takeoff, 3 s, twists at 10 Hz, land.

It flies a square, then forwards the commands of an outside controller on cmd_vel_in while that controller sends, and
stops half a second before it lands.
"""

import rospy
from geometry_msgs.msg import Twist
from listening import connected
from std_msgs.msg import Empty

RATE = 10  # Hz, in the node's time
WATCHDOG = 0.25  # s of the node's time, after which a silent outside controller counts as gone
CORNERS = ((1, 0), (0, 1), (-1, 0), (0, -1))


class SafePilot:
    """Pilot of the drone in whose namespace the node runs."""

    def __init__(self, leg):
        """Advertise and subscribe; `leg` is the duration of a leg of the square (s of the node's time)."""
        self._ticks = round(leg * RATE)
        self._reset, self._takeoff, self._land = (
            connected(rospy.Publisher(topic, Empty, queue_size=1)) for topic in ("reset", "takeoff", "land")
        )
        self._twists = connected(rospy.Publisher("cmd_vel", Twist, queue_size=1))
        self._outside, self._received = Twist(), rospy.Time()
        rospy.Subscriber("cmd_vel_in", Twist, self._take)

    def _take(self, message):
        self._outside, self._received = message, rospy.Time.now()

    def _outside_command(self):
        is_silent = (rospy.Time.now() - self._received).to_sec() > WATCHDOG
        return Twist() if is_silent else self._outside

    def fly(self):
        """Fly from the reset to the landing."""
        self._reset.publish()
        rospy.sleep(1)
        self._takeoff.publish()
        rospy.sleep(3)
        rate = rospy.Rate(RATE)
        for number in range(5 * self._ticks):
            twist = self._outside_command()
            if number < 4 * self._ticks:
                twist = Twist()
                twist.linear.x, twist.linear.y = (0.5 * part for part in CORNERS[number // self._ticks])
            self._twists.publish(twist)
            rate.sleep()
        self._twists.publish(Twist())
        rospy.sleep(0.5)
        self._land.publish()
        rospy.sleep(0.5)


if __name__ == "__main__":
    rospy.init_node("safe_pilot")
    SafePilot(float(rospy.myargv()[1])).fly()
