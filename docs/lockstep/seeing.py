#!/usr/bin/env python3
"""A vision node: each picture is answered by one command, whose stamp is the picture's, after up to 0.3 s of work."""

import random
import sys

import numpy as np
import rospy
from cv_bridge import CvBridge
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import Image

LONGEST = float(rospy.myargv(sys.argv)[1]) if len(rospy.myargv(sys.argv)) > 1 else 0.3  # s


def look(picture):
    """Turn towards the darker half of the picture, and climb."""
    gray = bridge.imgmsg_to_cv2(picture, "mono8").astype(float)
    rospy.rostime.wallsleep(random.uniform(0, LONGEST))  # heavy work, that takes another time each time
    left, right = np.array_split(gray, 2, axis=1)
    command = TwistStamped(header=picture.header)
    command.twist.linear.z = 0.2
    command.twist.angular.z = float(np.clip((right.mean() - left.mean()) / 50, -0.5, 0.5))
    commands.publish(command)


rospy.init_node("seeing")
bridge = CvBridge()
commands = rospy.Publisher("drone/cmd_vel_stamped", TwistStamped, queue_size=1, tcp_nodelay=True)
rospy.Subscriber("drone/front", Image, look, queue_size=1, buff_size=2**22, tcp_nodelay=True)
rospy.spin()
