#!/usr/bin/env python3
"""Follow a red ball with a Bebop: the real one with bebop_autonomy, or drone_sim with profile:=bebop.

The comments quote bebop_autonomy's documentation (docs/piloting.rst, docs/reading.rst).
"""

import cv2
import numpy as np
import rospy
from cv_bridge import CvBridge
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Empty

BALL = 0.15  # m, its radius
DISTANCE = 1.5  # m, from the camera, to keep
SMALLEST = 4  # px, the radius below which it is no ball
# "Acceptable range for all fields are [-1..1]": shares of the largest tilt, climb and turn rate.
LARGEST = 0.4
TILT, BRAKE = 0.25, 0.45  # per m of distance, per m/s: "pitch_degree = linear.x * max_tilt_angle" is an acceleration
TURN, CLIMB = 0.6, 0.6  # per half a picture


class Follower:
    """A command for each picture: "Input cmd_vel timeout" is 0.2 s, and pictures come at 20 to 30 Hz."""

    def __init__(self):
        self.bridge, self.focal, self.speed = CvBridge(), None, 0.0
        self.commands = rospy.Publisher("/bebop/cmd_vel", Twist, queue_size=1)
        self.takeoff = rospy.Publisher("/bebop/takeoff", Empty, queue_size=1, latch=True)
        self.land = rospy.Publisher("/bebop/land", Empty, queue_size=1)
        rospy.Subscriber("/bebop/camera_info", CameraInfo, self.on_info, queue_size=1)
        rospy.Subscriber("/bebop/odom", Odometry, self.on_odometry, queue_size=1)  # "limited to 5 Hz"
        rospy.Subscriber("/bebop/image_raw", Image, self.on_picture, queue_size=1, buff_size=2**22)

    def on_info(self, info):
        """Keep the focal length, in px."""
        self.focal = info.K[0]

    def on_odometry(self, odometry):
        """Keep the speed forward, which is in the frame of the heading."""
        self.speed = odometry.twist.twist.linear.x

    def on_picture(self, picture):
        """Turn to the ball, climb to it, and lean towards it. Zeros: "hover and maintain its current position"."""
        command, seen = Twist(), "no ball in sight"
        ball = find(self.bridge.imgmsg_to_cv2(picture, "rgb8"))
        if ball is not None and self.focal:
            x, y, radius = ball
            distance = self.focal * BALL / radius
            command.linear.x = cut(TILT * (distance - DISTANCE) - BRAKE * self.speed)
            command.linear.z = cut(CLIMB * (1 - 2 * y / picture.height))
            command.angular.z = cut(TURN * (1 - 2 * x / picture.width))
            seen = f"the ball is {distance:.1f} m away"
        self.commands.publish(command)
        rospy.loginfo_throttle(5.0, seen)


def find(picture):
    """Return the red ball's centre and radius in px, None if there is none."""
    hue, saturation, value = cv2.split(cv2.cvtColor(picture, cv2.COLOR_RGB2HSV))
    red = ((hue < 8) | (hue > 172)) & (saturation > 120) & (value > 40)
    outlines = cv2.findContours(red.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]
    (x, y), radius = max(map(cv2.minEnclosingCircle, outlines), key=lambda circle: circle[1], default=((0, 0), 0))
    return (x, y, radius) if radius > SMALLEST else None


def cut(share):
    return max(-LARGEST, min(LARGEST, share))


if __name__ == "__main__":
    rospy.init_node("follow_ball")
    follower = Follower()
    rospy.on_shutdown(lambda: follower.land.publish())
    follower.takeoff.publish()
    rospy.spin()
