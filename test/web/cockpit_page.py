"""What the tests of the cockpit's page share: what the node says of the drone, and how they wait for it."""

import time

WAIT = 30_000  # ms; a browser without a GPU is slow


class Drone:
    """What the node says of it; needs ROS, and a node that is initialised."""

    def __init__(self):
        import rospy
        from geometry_msgs.msg import TwistStamped
        from nav_msgs.msg import Odometry

        self.place = self.command = None
        rospy.Subscriber("/drone/odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber("/drone/command", TwistStamped, self._on_command, queue_size=1)

    def _on_odometry(self, message):
        at = message.pose.pose.position
        self.place = at.x, at.y, at.z

    def _on_command(self, message):
        self.command = message.twist.linear.x, message.twist.linear.z, message.twist.angular.z


def wait_until(page, condition, seconds=30):
    """Wait, and let the browser go on."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        page.wait_for_timeout(50)
