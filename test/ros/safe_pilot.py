#!/usr/bin/env python3
"""A node that flies as teleoperation nodes of real drones do: reset, a second, takeoff, three, twists at 10 Hz, land.

It flies a square, hands over to what comes on cmd_vel_in, and is silent before it lands.
"""

import rospy
from geometry_msgs.msg import Twist
from listening import connected
from std_msgs.msg import Empty

RATE = 10  # Hz, of its time
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
        self._outside = Twist()
        rospy.Subscriber("cmd_vel_in", Twist, self._take)

    def _take(self, message):
        self._outside = message

    def fly(self):
        """Fly from the reset to the landing."""
        self._reset.publish()
        rospy.sleep(1)
        self._takeoff.publish()
        rospy.sleep(3)
        rate = rospy.Rate(RATE)
        for number in range(5 * self._ticks):
            twist = self._outside
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
