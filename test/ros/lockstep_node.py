#!/usr/bin/env python3
"""Controller for lockstep tests: lockstep_node.py stamped|plain N DRONE sends N commands per odometry message."""

import sys

import rospy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry

KIND, TIMES, DRONE = sys.argv[1], int(sys.argv[2]), sys.argv[3]


def fly(odometry):
    here = odometry.pose.pose.position
    for number in range(TIMES):
        command = TwistStamped(header=odometry.header) if KIND == "stamped" else Twist()
        twist = command.twist if KIND == "stamped" else command
        twist.linear.x, twist.linear.z = 1.0 - here.x - 0.1 * number, 1.5 - here.z
        commands.publish(command)


rospy.init_node("controller", anonymous="--anonymous" in sys.argv)
topic, kind = ("cmd_vel_stamped", TwistStamped) if KIND == "stamped" else ("cmd_vel", Twist)
commands = rospy.Publisher(f"{DRONE}/{topic}", kind, queue_size=10, tcp_nodelay=True)
rospy.Subscriber(f"{DRONE}/odom", Odometry, fly, queue_size=10, tcp_nodelay=True)
rospy.spin()
