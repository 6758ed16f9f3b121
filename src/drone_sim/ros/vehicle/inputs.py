"""What a drone listens to. Callbacks run in rospy's threads: they check, and leave a job for the next step."""

from __future__ import annotations

from collections.abc import Sequence

import rospy
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, WrenchStamped
from geometry_msgs.msg import Twist as TwistMessage

from drone_sim.mechanics.state import Pose
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.vehicle.messages import WORLD
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.drone_objects import TARGET
from drone_sim.wording import shown


class DroneInput:
    """The commands of one drone, in its namespace."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Subscribe."""
        self._simulation = simulation
        self._parameters: Parameters = simulation.parameters
        self._inbox = inbox
        for topic, kind, callback in (
            ("cmd_vel", TwistMessage, self._on_twist),
            ("set_pose", PoseStamped, self._on_pose),
            ("initialpose", PoseWithCovarianceStamped, self._on_pose_estimate),
            ("target_pose", PoseStamped, self._on_target),
            ("push", WrenchStamped, self._on_push),
        ):
            name = f"{simulation.drone.name}/{topic}"
            rospy.Subscriber(name, kind, callback, queue_size=1, tcp_nodelay=True)

    def _on_twist(self, message: TwistMessage) -> None:
        try:
            twist = checks.twist(_numbers(message.linear), _numbers(message.angular), self._parameters)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"cmd_vel refused, the last good one is kept: {refused}")
            return
        self._inbox.put(lambda: self._simulation.drone.receive(twist))

    def _on_pose(self, message: PoseStamped) -> None:
        try:
            pose = self.checked(message.header.frame_id, message.pose)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"set_pose refused: {refused}")
            return
        self._inbox.put(lambda: self._simulation.drone.move(pose))

    def _on_pose_estimate(self, message: PoseWithCovarianceStamped) -> None:
        """Take rviz's 2D Pose Estimate: a place on the floor, a yaw; the height stays as it is."""
        try:
            (x, y, _), turn = self.checked(message.header.frame_id, message.pose.pose)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"initialpose refused: {refused}")
            return

        def move() -> None:
            drone = self._simulation.drone
            drone.move(Pose((x, y, drone.state.position[2]), turn))

        self._inbox.put(move)

    def _on_target(self, message: PoseStamped) -> None:
        try:
            pose = self.checked(message.header.frame_id, message.pose)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"target_pose refused: {refused}")
            return
        self._inbox.put(lambda: move_target(self._simulation, pose))

    def _on_push(self, message: WrenchStamped) -> None:
        try:
            _check_frame(message.header.frame_id)
            force, torque = _numbers(message.wrench.force), _numbers(message.wrench.torque)
            push = checks.push(force, torque, self._parameters)
        except checks.Refused as refused:
            rospy.logwarn_throttle(5, f"push refused: {refused}")
            return
        self._inbox.put(lambda: self._simulation.drone.push(*push))

    def checked(self, frame: str, message: PoseMessage) -> Pose:
        """Return a pose that came in a frame; raises Refused."""
        _check_frame(frame)
        turn = message.orientation
        return checks.pose(_numbers(message.position), (turn.x, turn.y, turn.z, turn.w), self._parameters)


def move_target(simulation: Simulation, pose: Pose) -> None:
    """Put the green sphere, DronePosition, there."""
    objects = simulation.drone.objects
    objects[objects.handle(TARGET)].put(pose.matrix)


def _check_frame(frame: str) -> None:
    if frame.lstrip("/") not in ("", WORLD):
        raise checks.Refused(f"frame_id {shown(frame)}: must be '{WORLD}'")


def _numbers(message: PoseMessage) -> Sequence[float]:
    return message.x, message.y, message.z
