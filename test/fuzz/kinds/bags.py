"""Bags of flights, written by rosbag: with odd values, other types and versions, truncated and damaged."""

import functools
import io
import tempfile
from pathlib import Path

import genpy
import rosbag
import roslib.message
import rospy
from case import Case
from hypothesis import strategies as st

from kinds.values import ODD_NUMBERS, mutated, small

_PICTURE = b"P6 2 2 255\n" + bytes(12)
_KINDS = {
    "/drone/odom": "nav_msgs/Odometry",
    "/drone/cmd_vel": "geometry_msgs/Twist",
    "/drone/command": "geometry_msgs/TwistStamped",
    "/drone/propellers": "std_msgs/Float32MultiArray",
    "/drone/state": "std_msgs/String",
    "/drone_sim/state": "std_msgs/String",
    "/drone/push": "geometry_msgs/WrenchStamped",
    "/drone/set_pose": "geometry_msgs/PoseStamped",
    "/drone/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "/drone/goto": "geometry_msgs/PoseStamped",
    "/drone/set_wind": "geometry_msgs/Vector3Stamped",
    "/drone/weather": "diagnostic_msgs/KeyValue",
    "/drone/takeoff": "std_msgs/Empty",
    "/drone/range": "sensor_msgs/Range",
    "/drone/imu/data": "sensor_msgs/Imu",
    "/drone/front": "sensor_msgs/Image",
    "/drone/front/compressed": "sensor_msgs/CompressedImage",
}
_OTHERS = ("no_such/Message", "nav_msgs", "", "../os/system", "os/path", "x" * 300)
_floats = st.one_of(small, st.sampled_from([float(one) for one in ODD_NUMBERS[:-1]]))
_numbers = st.one_of(st.integers(0, 3), st.integers(0, 2**31 - 1), st.just(2**32 - 1))
_times = st.one_of(st.integers(0, 40).map(lambda tenth: 1e8 * tenth), st.sampled_from([0.0, 1e17, 4.2e18]))  # ns


@functools.cache
def _fake_class(name: str) -> type:
    """Return a message class of that name with other fields."""
    return genpy.dynamic.generate_dynamic(name, "string data\n")[name]


def _set(message: genpy.Message, path: str, value: object) -> None:
    """Set the field at `path`, if the message has it."""
    *parents, name = path.split(".")
    for parent in parents:
        message = getattr(message, parent, None)
    if name in getattr(message, "__slots__", ()):
        setattr(message, name, value)


def _defaults(message: genpy.Message, at: float) -> None:
    for path, value in {
        "header.stamp": rospy.Time.from_sec(min(at * 1e-9, 4e9)),
        "pose.pose.orientation.w": 1.0,
        "pose.orientation.w": 1.0,
        "linear.x": 1.0,
        "format": "ppm",
    }.items():
        _set(message, path, value)
    if getattr(message, "_type", "") == "sensor_msgs/CompressedImage":
        message.data = _PICTURE


_FIELDS = {
    **dict.fromkeys(("pose.pose.position.x", "pose.position.z", "linear.x", "twist.linear.y", "range"), _floats),
    **dict.fromkeys(("pose.pose.orientation.w", "pose.orientation.x", "twist.twist.angular.z"), _floats),
    **dict.fromkeys(("wrench.force.x", "vector.x", "linear_acceleration.x"), _floats),
    **dict.fromkeys(("height", "width", "step"), _numbers),
    "header.frame_id": st.sampled_from(["", "world", "base_link", "a\nb"]),
    "encoding": st.sampled_from(["bgr8", "mono8", "32FC1", "16UC1", "", "bgr8; jpeg", "8UC200", "no\nsuch"]),
    "format": st.sampled_from(["jpeg", "png", "16UC1; compressedDepth png", "a\nb"]),
    "key": st.sampled_from(["wind", "wind/0", "/", "a" * 5000]),
    "value": st.sampled_from(["[1, 0, 0]", ".nan", "[" * 1000, "x: &a [*a]"]),
}
_CHANGE = st.sampled_from(sorted(_FIELDS)).flatmap(lambda path: st.tuples(st.just(path), _FIELDS[path]))
_WRITTEN = st.tuples(
    st.one_of(st.just("/drone/odom"), st.sampled_from(sorted(_KINDS))),
    st.one_of(*[st.none()] * 15, st.sampled_from(sorted({*_KINDS.values(), *_OTHERS}))),  # another type
    st.sampled_from([False] * 15 + [True]),  # a class of that name with other fields
    _times,
    st.lists(_CHANGE, max_size=2),
)


def _bag(written: list, compression: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "one.bag"
        with rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=2000) as bag:
            for topic, other, is_fake, at, changes in written:
                _write(bag, topic, _KINDS[topic] if other is None else other, is_fake, at, changes)
        return path.read_bytes()


def _write(bag: rosbag.Bag, topic: str, kind: str, is_fake: bool, at: float, changes: list) -> None:
    known = None if kind in _OTHERS or is_fake else roslib.message.get_message_class(kind)
    message = (known or _fake_class("nav_msgs/Odometry"))()
    _defaults(message, at)
    for path, value in changes:
        _set(message, path, value)
    buffer = io.BytesIO()
    message.serialize(buffer)
    raw = (kind if known is None else message._type, buffer.getvalue(), message._md5sum, None, type(message))
    bag.write(topic, raw, rospy.Time.from_sec(min(at * 1e-9, 4e9)), raw=True)


@st.composite
def _lengths(draw: st.DrawFn, content: bytes) -> bytes:
    """Return a bag with a huge number or 0 in four bytes, which may be a length."""
    at = draw(st.integers(13, max(len(content) - 4, 13)))
    return (
        content[:at] + draw(st.sampled_from([b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", bytes(4)])) + content[at + 4 :]
    )


_FLIGHT = [
    (topic, None, False, 1e8 * tenth, [])
    for tenth in (1, 2, 3)
    for topic in ("/drone/odom", "/drone/cmd_vel", "/drone/front/compressed")
]
_BAG = st.builds(
    _bag,
    st.lists(_WRITTEN, max_size=12).map(lambda more: _FLIGHT + more),
    st.sampled_from([rosbag.Compression.NONE, rosbag.Compression.BZ2, "lz4"]),
)
CASES = st.builds(
    lambda content, program: Case("bags", {"flight.bag": content}, program),
    st.one_of(_BAG, _BAG.flatmap(mutated), _BAG.flatmap(_lengths)),
    st.sampled_from(["bag_commands", "plot_flight", "bag_video"]),
)
