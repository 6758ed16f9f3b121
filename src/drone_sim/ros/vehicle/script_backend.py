"""Topics, services, parameters and frames of child scripts through rospy: a Backend (scripting/api/backend.py)."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import genpy
import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image as ImageMessage
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from drone_sim.ros.core import image_messages
from drone_sim.ros.core.inbox import Gate, open_gate
from drone_sim.ros.core.message_conversion import fill, message_class, service_class
from drone_sim.scripting.api.backend import Ask, Image
from drone_sim.scripting.api.service_servers import Unanswered

_SERVICE_TIMEOUT = 1.0  # s, in which the simulation waits


class RosBackend:
    """Subscriptions and publications of any installed message type."""

    def __init__(self, is_camera_topic: Callable[[str], bool], stamp: Callable[[], rospy.Time], gate: Gate = open_gate):
        """`stamp` returns the stamp of messages that are sent now.

        `is_camera_topic` returns whether the node's own cameras publish on a topic. `gate` wraps callbacks of
        subscriptions.
        """
        self._is_camera_topic, self._stamp, self._gate = is_camera_topic, stamp, gate
        self._frames: rospy.Publisher | None = None

    def time(self) -> float:
        """Return the present stamp, in s."""
        return float(self._stamp().to_sec())

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Broadcast frames; those without a stamp get that of the step."""
        self._frames = self._frames or rospy.Publisher("/tf", TFMessage, queue_size=100)
        messages = [fill(TransformStamped(), fields, "geometry_msgs/TransformStamped") for fields in transforms]
        for message in messages:
            message.header.stamp = message.header.stamp or self._stamp()
        self._frames.publish(TFMessage(messages))

    def parameter(self, name: str) -> Any:
        """Return a parameter, None if it is not set."""
        return rospy.get_param(name, None)

    def set_parameter(self, name: str, value: Any) -> None:
        rospy.set_param(name, value)

    def delete_parameter(self, name: str) -> None:
        """Delete a parameter if it is set."""
        with contextlib.suppress(KeyError):
            rospy.delete_param(name)

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Return the response of a service of a type such as std_srvs/Trigger.

        Raises ValueError if the type is not installed, the request does not fit, or no answer arrives within a second.
        """
        found = service_class(kind)
        filled = fill(found._request_class(), request, f"{kind}Request")
        answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def ask() -> None:
            try:
                rospy.wait_for_service(name, _SERVICE_TIMEOUT)
                answers.put(rospy.ServiceProxy(name, found)(filled))
            except (rospy.ROSException, rospy.ServiceException) as error:
                answers.put(error)

        threading.Thread(target=ask, name=f"service {name}", daemon=True).start()
        try:
            answer = answers.get(timeout=_SERVICE_TIMEOUT)
        except queue.Empty:
            raise ValueError(f"the service {name} did not answer within {_SERVICE_TIMEOUT:g} s") from None
        if isinstance(answer, Exception):
            raise ValueError(f"the service {name}: {' '.join(str(answer).split())}")
        return answer

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Offer a service, whose requests `ask` answers in rospy's threads; return a function that ends it.

        Raises ValueError if the type is not installed, or the node has a service of this name already.
        """
        found = service_class(kind)

        def handle(request: genpy.Message) -> genpy.Message:
            try:
                return ask(request, lambda fields: fill(found._response_class(), fields, f"{kind}Response"))
            except Unanswered as error:
                raise rospy.ServiceException(str(error)) from None

        try:
            server = rospy.Service(name, found, handle)
        except rospy.ServiceException as error:
            raise ValueError(" ".join(str(error).split())) from None
        return lambda: server.shutdown("the script ended")

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Call `take` with every message, in rospy's thread; return a function that ends it."""
        take = self._gate(topic, take)
        return rospy.Subscriber(topic, message_class(kind), take, queue_size=10).unregister

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> _Sender:
        made = message_class(kind)
        return _Sender(rospy.Publisher(topic, made, queue_size=queue, latch=latch), made, self._stamp)

    def advertise_image(self, topic: str, queue: int) -> Any:
        """Advertise an image topic; images are dropped if a camera of the node already publishes on it."""
        if self._is_camera_topic(topic):
            rospy.loginfo(f"{topic}: the node's camera already publishes it, so the script's images are not published")
            return SimpleNamespace(publish=lambda _image: None, subscribers=lambda: 0, shutdown=lambda: None)
        return _ImageSender(rospy.Publisher(topic, ImageMessage, queue_size=queue), ImageMessage, self._stamp)


class _Sender:
    def __init__(self, publisher: rospy.Publisher, made: type[genpy.Message], stamp: Callable[[], rospy.Time]):
        self._publisher, self._made, self._stamp = publisher, made, stamp

    def publish(self, message: Any) -> None:
        if self._publisher.get_num_connections():
            self._stamp()  # /clock before the message
        self._publisher.publish(fill(self._made(), message, self._made._type))

    def subscribers(self) -> int:
        return int(self._publisher.get_num_connections())

    def shutdown(self) -> None:
        self._publisher.unregister()


class _ImageSender(_Sender):
    def publish(self, image: Image) -> None:
        header = Header(stamp=self._stamp(), frame_id=image.frame_id)
        self._publisher.publish(image_messages.image(image.pixels, "rgb8", header))
