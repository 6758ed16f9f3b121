"""The interface to ROS: it carries a script's messages to other programs and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np


class Image(NamedTuple):
    """A picture that a script publishes: rgb8, the top row first, as sensor_msgs/Image has it."""

    pixels: np.ndarray  # height, width, 3
    frame_id: str


class MessageSender(Protocol):
    """One advertised topic of a backend."""

    def publish(self, message: Any) -> None:
        """Send a message; the simulation's thread calls it.

        It is what the script gave: a mapping of field names (nested; arrays are sequences, strings are
        str, or bytes where they are no UTF-8; times are numbers of seconds), or an object with the fields
        as attributes. A field left out keeps its default. An image (Backend.advertise_image) is an Image.
        Raises ValueError, in one line, for a field that does not exist or does not fit.
        """

    def subscribers(self) -> int:
        """Return the number of subscribers; also 0 if messages that are published here are not sent."""

    def shutdown(self) -> None:
        """Stop advertising."""


# Takes a request, and what makes a response of a script's answer; returns the response. Raises Unanswered.
Ask = Callable[[Any, Callable[[Any], Any]], Any]


class Backend(Protocol):
    """Transport of messages to and from other programs, such as rospy. Topic names are resolved: '/drone/front'.

    Types are written as ROS does: 'geometry_msgs/Twist'. Every function is called in the simulation's
    thread, and raises ValueError, in one line, for a type that is not installed.
    """

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Call `take` with every message, from any thread; return a function that ends the subscription.

        A message is an object with the fields as attributes (rospy's own will do), or a mapping.
        """

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> MessageSender:
        """Advertise a topic of any installed type."""

    def time(self) -> float:
        """Return what messages are stamped with, in s."""

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Broadcast frames, each with the fields of geometry_msgs/TransformStamped."""

    def parameter(self, name: str) -> Any:
        """Return a parameter by its full name, None where it is not set."""

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter."""

    def delete_parameter(self, name: str) -> None:
        """Forget a parameter, if it is set."""

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Call a service; raises ValueError, in one line, where it does not answer or fails."""

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Offer a service of any installed type; return a function that ends the service.

        Any thread may pass a request to `ask`, with a function that makes the response from the script's fields; `ask`
        returns the response. Raises ValueError also for a name that this process offers already.
        """

    def advertise_image(self, topic: str, queue: int) -> MessageSender:
        """Advertise a sensor_msgs/Image; its MessageSender takes Image tuples."""
