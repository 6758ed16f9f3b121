#!/usr/bin/env python3
"""A node that flies as teleoperation nodes of real drones do: reset, a second, takeoff, three, twists at 10 Hz, land.

It flies a square, then hands on what an outside controller sends on cmd_vel_in, as long as that goes on sending, and is
silent before it lands.
"""

import rospy
from geometry_msgs.msg import Twist
from listening import connected
from std_msgs.msg import Empty

RATE = 10  # Hz, of its time
WATCHDOG = 0.25  # s of its time, after which an outside controller counts as gone
CORNERS = ((1, 0), (0, 1), (-1, 0), (0, -1))


class SafePilot:
    """Commands the drone in whose namespace it is."""

    def __init__(self, leg):
        """Advertise and subscribe; a leg of the square takes so long (s of its time)."""
        self._ticks = round(leg * RATE)
        self._reset, self._takeoff, self._land = (
            connected(rospy.Publisher(topic, Empty, queue_size=1)) for topic in ("reset", "takeoff", "land")
        )
        self._twists = connected(rospy.Publisher("cmd_vel", Twist, queue_size=1))
        self._outside, self._came = Twist(), rospy.Time()
        rospy.Subscriber("cmd_vel_in", Twist, self._take)

    def _take(self, message):
        self._outside, self._came = message, rospy.Time.now()

    def _handed_on(self):
        gone = (rospy.Time.now() - self._came).to_sec() > WATCHDOG
        return Twist() if gone else self._outside

    def fly(self):
        """Fly from the reset to the landing."""
        self._reset.publish()
        rospy.sleep(1)
        self._takeoff.publish()
        rospy.sleep(3)
        rate = rospy.Rate(RATE)
        for number in range(5 * self._ticks):
            twist = self._handed_on()
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
