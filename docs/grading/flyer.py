#!/usr/bin/env python3
"""A student's node: flies to a place, and back, by what /drone/odom says."""

import math

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from drone_sim.ros.core.shutdown import end_on_signals

PLACES = [(1.0, 0.0), (0.0, 0.0)]  # m, one after the other
NEAR = 0.1  # m
GAIN, FASTEST = 0.8, 0.5  # 1/s, m/s


class Flyer:
    """Answers every odometry with a command: no clock of its own, at whatever pace the simulation goes."""

    def __init__(self):
        """Begin with the first place."""
        self.left = list(PLACES)
        self.commands = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("/drone/odom", Odometry, self.fly, queue_size=1)

    def fly(self, odometry):
        """Go towards the place; the drone looks along x all the time."""
        here = odometry.pose.pose.position
        ahead, aside = self.left[0][0] - here.x, self.left[0][1] - here.y
        if math.hypot(ahead, aside) < NEAR and len(self.left) > 1:
            self.left.pop(0)
        command = Twist()
        command.linear.x, command.linear.y = (max(-FASTEST, min(FASTEST, GAIN * way)) for way in (ahead, aside))
        self.commands.publish(command)


if __name__ == "__main__":
    rospy.init_node("flyer", disable_signals=True)
    end_on_signals()
    Flyer()
    rospy.spin()
