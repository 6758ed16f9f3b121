"""Conversion of the simulation's values to ROS messages and back, and of mappings to messages of any installed type."""

from __future__ import annotations

import difflib
import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import genpy
import roslib.message
import rospkg
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, TransformStamped, TwistStamped, Vector3
from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, JointState
from std_msgs.msg import Float32MultiArray, Header, MultiArrayDimension, MultiArrayLayout

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import State, Twist
from drone_sim.message_text import encodable
from drone_sim.render.intrinsics import Intrinsics

if TYPE_CHECKING:
    from drone_sim.vehicles.parameters import VehicleParameters

WORLD_FRAME = "world"
BASE_LINK = "base_link"  # of a vehicle's root link
TRACK_BASE = "Track_base"  # level with the ground; commands are in this frame


def frame(vehicle: VehicleParameters, name: str) -> str:
    """Return the full name of a vehicle's frame, such as `a/drone2/front_optical`; `world` stays unchanged.

    All nodes broadcast on the same /tf. Two simulators under one master, each in its own namespace, share the frame
    `world`; the namespace in the names separates their other frames.
    """
    return name if name == WORLD_FRAME else f"{rospy.get_namespace()}{vehicle.frame_prefix}{name}".lstrip("/")


def full_name(vehicle: str, topic: str) -> str:
    """Return a topic's name in the namespace of the node: in that of a vehicle, unless it begins with a slash."""
    return topic[1:] if topic.startswith("/") else f"{vehicle}/{topic}"


def first_frame(simulator: str) -> str:
    """Return the frame that rviz follows, which is at Track_base of the first vehicle of the node `simulator`."""
    return f"{simulator.strip('/')}/first"


def ros_time(seconds: float, kind: type[genpy.TVal] = rospy.Time) -> Any:
    """Return seconds as a ROS time or duration, rounded to the nearest nanosecond; ROS's from_sec truncates."""
    return kind(*divmod(round(seconds * 1e9), 10**9))


def odometry(stamp: rospy.Time, state: State, child: str) -> Odometry:
    """Return a state as a message: pose in the world, twist in the child frame; covariances are 0, meaning exact."""
    message = Odometry(header=Header(stamp=stamp, frame_id=WORLD_FRAME), child_frame_id=child)
    message.pose.pose = Pose(Point(*state.position), Quaternion(*state.orientation))
    matrix = state.matrix
    linear = frames.rotate_back(matrix, state.linear_velocity)
    message.twist.twist = twist(linear, frames.rotate_back(matrix, state.angular_velocity))
    return message


def transform(stamp: rospy.Time, parent: str, child: str, matrix: Matrix) -> TransformStamped:
    """Return the child's pose in the parent frame as a transform."""
    translation, rotation = Vector3(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix))
    return TransformStamped(Header(stamp=stamp, frame_id=parent), child, Transform(translation, rotation))


def pose(matrix: Matrix) -> Pose:
    return Pose(Point(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))


def camera_info(intrinsics: Intrinsics, frame: str) -> CameraInfo:
    """Return the camera model as a message without a stamp."""
    size = {"width": intrinsics.width, "height": intrinsics.height}
    message = CameraInfo(header=Header(frame_id=frame), **size)
    message.distortion_model, message.D = intrinsics.distortion
    message.K, message.P = intrinsics.K, intrinsics.P
    message.R = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    return message


def twist(linear: Sequence[float], angular: Sequence[float]) -> TwistMessage:
    return TwistMessage(Vector3(*linear), Vector3(*angular))


def command(stamp: rospy.Time, velocities: Twist, frame: str) -> TwistStamped:
    return TwistStamped(Header(stamp=stamp, frame_id=frame), twist(velocities.linear, velocities.angular))


def propellers(velocities: Sequence[float]) -> Float32MultiArray:
    """Return the commanded particle velocities (m/s) of propellers 1, 2, … as a message."""
    label = "front_left back_left back_right front_right" if len(velocities) == 4 else "propellers"
    layout = MultiArrayLayout(dim=[MultiArrayDimension(label, len(velocities), len(velocities))])
    return Float32MultiArray(layout=layout, data=velocities)


def joint_states(stamp: rospy.Time, angles: Mapping[str, float]) -> JointState:
    """Return joint angles (rad) by joint name as a message."""
    return JointState(header=Header(stamp=stamp), name=list(angles), position=list(angles.values()))


# ---- from messages


def xyz(vector: Any) -> Vector:
    """Return x, y and z of a Point or Vector3."""
    return vector.x, vector.y, vector.z


def xyzw(quaternion: Any) -> tuple[float, float, float, float]:
    return quaternion.x, quaternion.y, quaternion.z, quaternion.w


def odometry_row(message: Odometry) -> tuple[float, ...]:
    """Return position, quaternion (xyzw), linear and angular velocity, all in the world frame."""
    position, quaternion = xyz(message.pose.pose.position), xyzw(message.pose.pose.orientation)
    matrix = frames.from_quaternion(position, quaternion)
    linear, angular = xyz(message.twist.twist.linear), xyz(message.twist.twist.angular)
    return *position, *quaternion, *frames.rotate(matrix, linear), *frames.rotate(matrix, angular)


def level_motion(row: Sequence[float]) -> tuple[Vector, Vector, Vector]:
    """Return position, roll/pitch/yaw, and linear velocity in the level frame, of a row from `odometry_row`."""
    position = row[0], row[1], row[2]
    rpy = frames.to_rpy(frames.from_quaternion(position, row[3:7]))
    return position, rpy, frames.rotate(frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -rpy[2])), row[7:10])


# ---- messages of any installed type


def message_class(kind: str) -> type[genpy.Message]:
    """Return the class of a message type such as sensor_msgs/Imu. Raises ValueError if it is not installed."""
    message = _find_class(roslib.message.get_message_class, kind)
    if message is None:
        reason = _missing_build(kind, "msg") or f"is not installed{_near_types(kind)}"
        raise ValueError(f"message type '{kind}' {reason}")
    return message


def service_class(kind: str) -> Any:
    """Return the class of a service type such as std_srvs/Trigger. Raises ValueError if it is not installed."""
    service = _find_class(roslib.message.get_service_class, kind)
    if service is None:
        raise ValueError(f"service type '{kind:.80}' {_missing_build(kind, 'srv') or 'is not installed'}")
    return service


def _find_class(find: Callable[[str], Any], kind: str) -> Any:
    try:
        return find(kind)
    except (ImportError, ValueError):
        return None
    except Exception as error:  # such as catkin_pkg's InvalidPackage, of a package.xml
        raise ValueError(f"type '{kind:.80}' cannot be found: {' '.join(str(error).split())}") from None


def _missing_build(kind: str, ending: str) -> str:
    """Return a message for a type with a .msg or .srv file, but without a Python class; '' for another type."""
    package, _, name = kind.partition("/")
    try:
        file = f"{rospkg.RosPack().get_path(package)}/{ending}/{name}.{ending}"
    except rospkg.ResourceNotFound:
        return ""
    cure = f"build the package {package}, and source the setup.bash of its workspace"
    return f"is in {file}, but its Python code was never generated: {cure}" if os.path.isfile(file) else ""


def _near_types(kind: str) -> str:
    package, _, name = kind.partition("/")
    try:
        known = [kind for kind in dir(importlib.import_module(f"{package}.msg")) if kind[0] != "_"]
        near = [f"{package}/{kind}" for kind in difflib.get_close_matches(name, known)]
    except (ImportError, ValueError):
        near = [f"{other}/{name}" for other in difflib.get_close_matches(package, rospkg.RosPack().list())]
    return f"; near names are {', '.join(near)}" if near else ""


def fill(message: genpy.Message, values: Any, path: str) -> genpy.Message:
    """Set fields of a message from a mapping, or from an object's attributes; other fields keep their default.

    `path` names the message in errors. Raises ValueError.
    """
    if isinstance(values, type(message)):
        return values
    types = dict(zip(message.__slots__, message._slot_types))
    if not isinstance(values, Mapping):
        values = {name: getattr(values, name) for name in types if hasattr(values, name)}
    for name, value in values.items():
        if name not in types:
            raise ValueError(f"{path} has no field '{name}'; it has {', '.join(types)}")
        setattr(message, name, _field_value(types[name], value, f"{path}.{name}"))
    try:
        message._check_types()
    except (genpy.MessageException, genpy.SerializationError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None
    return message


def _field_value(kind: str, value: Any, path: str) -> Any:
    if kind in ("time", "duration"):
        time_class = genpy.Time if kind == "time" else genpy.Duration
        return ros_time(value, time_class) if isinstance(value, (int, float)) else value
    if "[" in kind:
        element = kind.partition("[")[0]
        if element in ("uint8", "char") and isinstance(value, (bytes, str)):
            return value.encode() if isinstance(value, str) else value
        return [_field_value(element, item, f"{path}[{index}]") for index, item in enumerate(value)]
    if "/" in kind:
        return fill(message_class(kind)(), value, path)
    if kind.startswith(("int", "uint")) and isinstance(value, float) and value.is_integer():
        return int(value)  # Lua 5.1 has no integers
    return encodable(value) if kind == "string" and isinstance(value, str) else value
