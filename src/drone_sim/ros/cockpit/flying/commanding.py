"""The topics by which one vehicle is told what to do."""

from __future__ import annotations

import threading

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Empty

from drone_sim.ros.tools.commands import Command

REQUESTS = ("takeoff", "land", "home", "reset")


class Commanding:
    """Publishes to the chosen vehicle. A topic needs a moment until its publisher is heard: `choose` comes before."""

    def __init__(self) -> None:
        """Begin without a vehicle."""
        self.vehicle = ""
        self._lock = threading.Lock()  # or one thread sends by what another has just put away
        self._command: rospy.Publisher | None = None
        self._requests: dict[str, rospy.Publisher] = {}

    def choose(self, vehicle: str) -> None:
        """Tell another vehicle what to do from now on, '' for none; the last one is stopped."""
        if vehicle == self.vehicle:
            return
        self.send(Command())
        with self._lock:
            old = (self._command, *self._requests.values())
            self.vehicle, self._command, self._requests = vehicle, None, {}
        for one in old:
            if one is not None:
                one.unregister()
        if vehicle:
            self._command = rospy.Publisher(f"/{vehicle}/cmd_vel", Twist, queue_size=1)
            self._requests = {topic: rospy.Publisher(f"/{vehicle}/{topic}", Empty, queue_size=1) for topic in REQUESTS}

    def send(self, command: Command) -> None:
        """Send a command, m/s and rad/s in the frame Track_base."""
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z = command
        with self._lock:
            if self._command is not None:
                self._command.publish(twist)

    def request(self, topic: str) -> str:
        """Ask for what one of `REQUESTS` does; return one line for the user."""
        publisher = self._requests.get(topic)
        if publisher is None or not publisher.get_num_connections():
            return f"{topic}: nobody listens"
        publisher.publish(Empty())
        return f"{topic} sent to {self.vehicle}"
