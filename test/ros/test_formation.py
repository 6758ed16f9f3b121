#!/usr/bin/env python3
"""The example of docs/fleet.md: two drones follow a third one in formation."""

import math
import subprocess
import sys
import unittest
from pathlib import Path

import rospy
import rostest
from geometry_msgs.msg import Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry

FOLLOW = Path(__file__).resolve().parents[2] / "docs" / "fleet" / "follow.py"
WINGS = {"drone2": (-1.0, 1.0), "drone3": (-1.0, -1.0)}


def formation_error(follower, leader, wing):
    """Return the follower's distance from its wing position (m) plus the speeds of follower and leader (m/s)."""
    (ahead, left), pose = wing, leader.pose.pose
    yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    x = pose.position.x + ahead * math.cos(yaw) - left * math.sin(yaw)
    y = pose.position.y + ahead * math.sin(yaw) + left * math.cos(yaw)
    place = follower.pose.pose.position
    speeds = [math.hypot(one.twist.twist.linear.x, one.twist.twist.linear.y) for one in (follower, leader)]
    return math.hypot(place.x - x, place.y - y) + sum(speeds)


class Formation(unittest.TestCase):
    def test_the_followers_keep_their_wings(self):
        odometry = {name: Listener(f"{name}/odom", Odometry) for name in ("drone1", *WINGS)}
        commands = connected(rospy.Publisher("/drone1/cmd_vel", Twist, queue_size=1))
        node = subprocess.Popen([sys.executable, str(FOLLOW)])
        try:
            twist = Twist()
            twist.linear.x, twist.angular.z = 0.5, 0.3
            commands.publish(twist)
            odometry["drone1"].wait_for(lambda o: o.pose.pose.position.y > 1.5)
            commands.publish(Twist())
            for name, wing in WINGS.items():
                odometry[name].wait_for(
                    lambda o, wing=wing: formation_error(o, odometry["drone1"].messages[-1], wing) < 0.05, timeout=90
                )
        finally:
            # Not SIGTERM: rospy's own handler closes topics, and waits for ever if it interrupts `publish` (see
            # ros/core/shutdown.py). How a user's script ends is not tested here.
            node.kill()
            node.wait(90)


if __name__ == "__main__":
    rospy.init_node("test_formation")
    sys.exit(rostest.rosrun("drone_sim", "formation", Formation))
