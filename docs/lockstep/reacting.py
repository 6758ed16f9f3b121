#!/usr/bin/env python3
"""A node that reacts in a callback: each odometry is answered by one command."""

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

GOAL, GAIN = (1.0, 0.5, 1.5), 0.4  # m, 1/s


def fly(odometry):
    """Answer one odometry. The drone looks along x all the time."""
    here, command = odometry.pose.pose.position, Twist()
    command.linear.x, command.linear.y = GAIN * (GOAL[0] - here.x), GAIN * (GOAL[1] - here.y)
    command.linear.z = GAIN * (GOAL[2] - here.z)
    commands.publish(command)


rospy.init_node("reacting")
commands = rospy.Publisher("drone/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
rospy.Subscriber("drone/odom", Odometry, fly, queue_size=1, tcp_nodelay=True)
rospy.spin()
