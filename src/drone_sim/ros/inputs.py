"""What a drone listens to. Callbacks run in rospy's threads: they check, and leave a value for the next step."""

from __future__ import annotations

from queue import Empty, SimpleQueue
from typing import Callable

import rospy
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from geometry_msgs.msg import Twist as TwistMessage

from drone_sim import checks
from drone_sim.drone import Drone
from drone_sim.parameters import Parameters
from drone_sim.ros.messages import WORLD
from drone_sim.state import Pose


class DroneInput:
    """The commands of one drone."""

    def __init__(self, drone: Drone, parameters: Parameters):
        """Subscribe in the drone's namespace."""
        self._drone = drone
        self._parameters = parameters
        self._waiting: SimpleQueue[Callable[[], None]] = SimpleQueue()
        name = drone.name
        rospy.Subscriber(f"{name}/cmd_vel", TwistMessage, self._on_twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber(f"{name}/set_pose", PoseStamped, self._on_pose, queue_size=1)
        rospy.Subscriber(f"{name}/initialpose", PoseWithCovarianceStamped, self._on_pose_estimate, queue_size=1)

    def apply(self) -> None:
        """Carry out what has come in since the last step; the simulation's thread calls it."""
        while True:
            try:
                self._waiting.get_nowait()()
            except Empty:
                return

    def _on_twist(self, message: TwistMessage) -> None:
        linear, angular = message.linear, message.angular
        try:
            twist = checks.twist((linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z), self._parameters)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"cmd_vel refused, the last good one is kept: {refused}")
            return
        self._waiting.put(lambda: self._drone.receive(twist))

    def _on_pose(self, message: PoseStamped) -> None:
        pose = self._checked("set_pose", message.header.frame_id, message.pose)
        if pose is not None:
            self._waiting.put(lambda: self._drone.move(pose))

    def _on_pose_estimate(self, message: PoseWithCovarianceStamped) -> None:
        """Take rviz's 2D Pose Estimate: a place on the floor, a yaw; the height stays as it is."""
        pose = self._checked("initialpose", message.header.frame_id, message.pose.pose)
        if pose is not None:
            (x, y, _), orientation = pose
            self._waiting.put(lambda: self._drone.move(Pose((x, y, self._drone.state.position[2]), orientation)))

    def _checked(self, topic: str, frame: str, message: PoseMessage) -> Pose | None:
        place, turn = message.position, message.orientation
        try:
            if frame.lstrip("/") not in ("", WORLD):
                raise checks.Refused(f"frame_id '{frame}': must be '{WORLD}'")
            return checks.pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w), self._parameters)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"{topic} refused: {refused}")
            return None
