"""Topics of a child script through rospy: a Backend (scripting/api/backend.py)."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Callable, Collection, Mapping
from typing import Any

import genpy
import roslib.message
import rospkg
import rospy
from sensor_msgs.msg import Image as ImageMessage

from drone_sim.scripting.api.backend import Image


class RosBackend:
    """Subscribes and advertises any installed message type."""

    def __init__(self, camera_topics: Collection[str], stamp: Callable[[], rospy.Time]):
        """Take the resolved image topics that the node's own cameras publish already, and what to stamp with."""
        self._camera_topics = camera_topics
        self._stamp = stamp

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Call `take` with every message, in rospy's thread; return what ends that."""
        return rospy.Subscriber(topic, _message_class(kind), take, queue_size=10).unregister

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> _Sender:
        """Advertise a topic."""
        made = _message_class(kind)
        return _Sender(rospy.Publisher(topic, made, queue_size=queue, latch=latch), made, self._stamp)

    def advertise_image(self, topic: str, queue: int) -> Any:
        """Advertise an image topic; one that a camera publishes already stays the camera's."""
        if topic in self._camera_topics:
            rospy.loginfo(f"{topic}: the node's camera publishes it already; the script's images are not sent twice")
            return _Silence()
        return _ImageSender(rospy.Publisher(topic, ImageMessage, queue_size=queue), self._stamp)


class _Sender:
    def __init__(self, publisher: rospy.Publisher, made: type[genpy.Message], stamp: Callable[[], rospy.Time]):
        self._publisher = publisher
        self._made = made
        self._stamp = stamp

    def publish(self, message: Any) -> None:
        if self._publisher.get_num_connections():
            self._stamp()  # /clock before the message
        self._publisher.publish(_fill(self._made(), message, self._made._type))

    def shutdown(self) -> None:
        self._publisher.unregister()


class _ImageSender:
    def __init__(self, publisher: rospy.Publisher, stamp: Callable[[], rospy.Time]):
        self._publisher = publisher
        self._stamp = stamp

    def publish(self, image: Image) -> None:
        message = ImageMessage(width=image.width, height=image.height, encoding="rgb8", step=3 * image.width)
        message.header.stamp, message.header.frame_id = self._stamp(), image.frame_id
        message.data = image.data
        self._publisher.publish(message)

    def shutdown(self) -> None:
        self._publisher.unregister()


class _Silence:
    def publish(self, _message: Any) -> None:
        pass

    def shutdown(self) -> None:
        pass


def _message_class(kind: str) -> type[genpy.Message]:
    try:
        found = roslib.message.get_message_class(kind)
    except (ImportError, ValueError):
        found = None
    if found is None:
        raise ValueError(f"message type '{kind}' is not installed{_near_types(kind)}")
    return found


def _near_types(kind: str) -> str:
    package, _, name = kind.partition("/")
    try:
        known = [one for one in dir(importlib.import_module(f"{package}.msg")) if one[0] != "_"]
        near = [f"{package}/{one}" for one in difflib.get_close_matches(name, known)]
    except (ImportError, ValueError):
        near = [f"{one}/{name}" for one in difflib.get_close_matches(package, rospkg.RosPack().list())]
    return f"; near names are {', '.join(near)}" if near else ""


def _fill(message: genpy.Message, given: Any, path: str) -> genpy.Message:
    """Set the fields of a message from a mapping, or an object with attributes; what is left out keeps its default."""
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
        return made.from_sec(value) if isinstance(value, (int, float)) else value
    if "[" in kind:
        element = kind.partition("[")[0]
        if element in ("uint8", "char") and isinstance(value, (bytes, str)):
            return value.encode() if isinstance(value, str) else value
        return [_value(element, one, f"{path}[{index}]") for index, one in enumerate(value)]
    if "/" in kind:
        return _fill(_message_class(kind)(), value, path)
    if kind.startswith(("int", "uint")) and isinstance(value, float) and value.is_integer():
        return int(value)  # Lua 5.1 has no integers
    return value
