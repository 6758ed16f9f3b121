"""The simulation's values as ROS messages, and back; messages of any installed type from mappings, lists, texts.

Every message of a step gets the same stamp.
"""

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

WORLD_FRAME, BASE_LINK, TRACK_BASE = "world", "base_link", "Track_base"  # the root link; level, in which commands count


def frame(vehicle: VehicleParameters, name: str) -> str:
    """Return what a vehicle's frame is called, such as `a/drone2/front_optical`; `world` is everybody's.

    All nodes broadcast on the same /tf. Two simulators under one master, each in its own namespace, make one tree below
    `world`; the namespace keeps their frames apart, like their topics.
    """
    return name if name == WORLD_FRAME else f"{rospy.get_namespace()}{vehicle.frame_prefix}{name}".lstrip("/")


def first_frame(simulator: str) -> str:
    """Return the name of the frame that rviz follows: Track_base of the first vehicle of the node `simulator`."""
    return f"{simulator.strip('/')}/first"


def ros_time(seconds: float, kind: type[genpy.TVal] = rospy.Time) -> Any:
    """Return seconds as ROS's time, or as a duration, to the nearest nanosecond; its own from_sec cuts off the rest."""
    return kind(*divmod(round(seconds * 1e9), 10**9))


def odometry(stamp: rospy.Time, state: State, child: str) -> Odometry:
    """Return the ground truth: pose in the world, twist in the child frame (covariances 0: exact)."""
    message = Odometry(header=Header(stamp=stamp, frame_id=WORLD_FRAME), child_frame_id=child)
    message.pose.pose = Pose(Point(*state.position), Quaternion(*state.orientation))
    child_from_world = frames.invert(state.matrix)
    velocities = state.linear_velocity, state.angular_velocity
    message.twist.twist = twist(*(frames.rotate(child_from_world, one) for one in velocities))
    return message


def transform(stamp: rospy.Time, parent: str, child: str, matrix: Matrix) -> TransformStamped:
    """Return the transform parent from child."""
    place = Transform(Vector3(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))
    return TransformStamped(Header(stamp=stamp, frame_id=parent), child, place)


def pose(matrix: Matrix) -> Pose:
    """Return a place."""
    return Pose(Point(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))


def camera_info(intrinsics: Intrinsics, frame: str) -> CameraInfo:
    """Return the camera's model, without a stamp."""
    size = {"width": intrinsics.width, "height": intrinsics.height}
    message = CameraInfo(header=Header(frame_id=frame), **size)
    message.distortion_model, message.D = intrinsics.distortion
    message.K, message.P = intrinsics.K, intrinsics.P
    message.R = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    return message


def twist(linear: Sequence[float], angular: Sequence[float]) -> TwistMessage:
    """Return velocities, or what is commanded."""
    return TwistMessage(Vector3(*linear), Vector3(*angular))


def command(stamp: rospy.Time, given: Twist, frame: str) -> TwistStamped:
    """Return the command in force, in its frame."""
    return TwistStamped(Header(stamp=stamp, frame_id=frame), twist(given.linear, given.angular))


def propellers(velocities: Sequence[float]) -> Float32MultiArray:
    """Return the commanded particle velocities (m/s), propellers 1, 2, and so on."""
    label = "front_left back_left back_right front_right" if len(velocities) == 4 else "propellers"
    layout = MultiArrayLayout(dim=[MultiArrayDimension(label, len(velocities), len(velocities))])
    return Float32MultiArray(layout=layout, data=velocities)


def joint_states(stamp: rospy.Time, angles: Mapping[str, float]) -> JointState:
    """Return the angles (rad) of joints."""
    return JointState(header=Header(stamp=stamp), name=list(angles), position=list(angles.values()))


# ---- back


def xyz(vector: Any) -> Vector:
    """Return the numbers of a Point or Vector3."""
    return vector.x, vector.y, vector.z


def xyzw(quaternion: Any) -> tuple[float, float, float, float]:
    """Return the numbers of a Quaternion."""
    return quaternion.x, quaternion.y, quaternion.z, quaternion.w


def odometry_row(message: Odometry) -> tuple[float, ...]:
    """Return position, quaternion and velocities, in the world."""
    place, quaternion = xyz(message.pose.pose.position), xyzw(message.pose.pose.orientation)
    matrix = frames.from_quaternion(place, quaternion)
    linear, angular = xyz(message.twist.twist.linear), xyz(message.twist.twist.angular)
    return *place, *quaternion, *frames.rotate(matrix, linear), *frames.rotate(matrix, angular)


def level_motion(row: Sequence[float]) -> tuple[Vector, Vector, Vector]:
    """Return position, roll, pitch and yaw, and the velocity in the level frame, of a row of odometry."""
    place = row[0], row[1], row[2]
    rpy = frames.to_rpy(frames.from_quaternion(place, row[3:7]))
    return place, rpy, frames.rotate(frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, -rpy[2])), row[7:10])


# ---- any installed type


def message_class(kind: str) -> type[genpy.Message]:
    """Return the class of a message type such as sensor_msgs/Imu; raises ValueError where it is not installed."""
    found = _installed(roslib.message.get_message_class, kind)
    if found is None:
        why = _not_generated(kind, "msg") or f"is not installed{_near_types(kind)}"
        raise ValueError(f"message type '{kind}' {why}")
    return found


def service_class(kind: str) -> Any:
    """Return the class of a service type such as std_srvs/Trigger; raises ValueError where it is not installed."""
    found = _installed(roslib.message.get_service_class, kind)
    if found is None:
        raise ValueError(f"service type '{kind:.80}' {_not_generated(kind, 'srv') or 'is not installed'}")
    return found


def _installed(find: Callable[[str], Any], kind: str) -> Any:
    try:
        return find(kind)
    except (ImportError, ValueError):
        return None


def _not_generated(kind: str, ending: str) -> str:
    """Return what to do for a type whose .msg or .srv file is there, but not its Python class; '' for another type."""
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
        known = [one for one in dir(importlib.import_module(f"{package}.msg")) if one[0] != "_"]
        near = [f"{package}/{one}" for one in difflib.get_close_matches(name, known)]
    except (ImportError, ValueError):
        near = [f"{one}/{name}" for one in difflib.get_close_matches(package, rospkg.RosPack().list())]
    return f"; near names are {', '.join(near)}" if near else ""


def fill(message: genpy.Message, given: Any, path: str) -> genpy.Message:
    """Set the fields of a message from a mapping, or an object with attributes; what is left out keeps its default.

    `path` names the message where something is wrong. Raises ValueError.
    """
    if isinstance(given, type(message)):
        return given
    types = dict(zip(message.__slots__, message._slot_types))
    if not isinstance(given, Mapping):
        given = {name: getattr(given, name) for name in types if hasattr(given, name)}
    for name, value in given.items():
        if name not in types:
            raise ValueError(f"{path} has no field '{name}'; it has {', '.join(types)}")
        setattr(message, name, _value(types[name], value, f"{path}.{name}"))
    try:
        message._check_types()
    except (genpy.MessageException, genpy.SerializationError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None
    return message


def _value(kind: str, value: Any, path: str) -> Any:
    if kind in ("time", "duration"):
        made = genpy.Time if kind == "time" else genpy.Duration
        return ros_time(value, made) if isinstance(value, (int, float)) else value
    if "[" in kind:
        element = kind.partition("[")[0]
        if element in ("uint8", "char") and isinstance(value, (bytes, str)):
            return value.encode() if isinstance(value, str) else value
        return [_value(element, one, f"{path}[{index}]") for index, one in enumerate(value)]
    if "/" in kind:
        return fill(message_class(kind)(), value, path)
    if kind.startswith(("int", "uint")) and isinstance(value, float) and value.is_integer():
        return int(value)  # Lua 5.1 has no integers
    return encodable(value) if kind == "string" and isinstance(value, str) else value
