"""The simulation's values as ROS messages. Every message of a step gets the same stamp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import genpy
import rospy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, TwistStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, MultiArrayLayout

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.state import State, Twist
from drone_sim.render.intrinsics import Intrinsics

WORLD_FRAME = "world"


def ros_time(seconds: float, kind: type[genpy.TVal] = rospy.Time) -> Any:
    """Return seconds as ROS's time, or as a duration, to the nearest nanosecond; its own from_sec cuts off the rest."""
    return kind(*divmod(round(seconds * 1e9), 10**9))


def odometry(stamp: rospy.Time, state: State, child: str) -> Odometry:
    """Return the ground truth: pose in the world, twist in the child frame (covariances 0: exact)."""
    message = Odometry()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, WORLD_FRAME, child
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    place.x, place.y, place.z = state.position
    turn.x, turn.y, turn.z, turn.w = state.orientation
    child_from_world = frames.invert(state.matrix)
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    linear.x, linear.y, linear.z = frames.rotate(child_from_world, state.linear_velocity)
    angular.x, angular.y, angular.z = frames.rotate(child_from_world, state.angular_velocity)
    return message


def transform(stamp: rospy.Time, parent: str, child: str, matrix: Matrix) -> TransformStamped:
    """Return the transform parent from child."""
    message = TransformStamped(child_frame_id=child)
    message.header.stamp, message.header.frame_id = stamp, parent
    message.transform = Transform(Vector3(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))
    return message


def camera_info(intrinsics: Intrinsics, frame: str) -> CameraInfo:
    """Return the camera's model, without a stamp: an ideal pinhole."""
    message = CameraInfo(width=intrinsics.width, height=intrinsics.height)
    message.header.frame_id = frame
    message.distortion_model = "plumb_bob"
    message.D = [0.0] * 5
    message.K, message.P = intrinsics.K, intrinsics.P
    message.R = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    return message


def command(stamp: rospy.Time, twist: Twist, frame: str) -> TwistStamped:
    """Return the command in force, in its frame."""
    message = TwistStamped()
    message.header.stamp, message.header.frame_id = stamp, frame
    message.twist.linear, message.twist.angular = Vector3(*twist.linear), Vector3(*twist.angular)
    return message


def propellers(velocities: Sequence[float]) -> Float32MultiArray:
    """Return the commanded particle velocities (m/s), propellers 1 to 4."""
    label = "front_left back_left back_right front_right"
    layout = MultiArrayLayout(dim=[MultiArrayDimension(label, len(velocities), len(velocities))])
    return Float32MultiArray(layout=layout, data=velocities)


def joint_states(stamp: rospy.Time, angles: Mapping[str, float]) -> JointState:
    """Return the angles (rad) of joints."""
    message = JointState(name=list(angles), position=list(angles.values()))
    message.header.stamp = stamp
    return message
