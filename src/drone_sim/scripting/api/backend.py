"""Interface to ROS for the messages between a script and other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np


class Image(NamedTuple):
    """A picture that a script publishes: rgb8, top row first, as in sensor_msgs/Image."""

    pixels: np.ndarray  # height, width, 3
    frame_id: str


class MessageSender(Protocol):
    """An advertised topic of a backend."""

    def publish(self, message: Any) -> None:
        """Send a message; called in the simulation's thread.

        It is the script's value: a mapping of field names (nested; arrays are sequences; strings are str, or bytes if
        they are not UTF-8; times are in s), or an object with the fields as attributes. A missing field keeps its
        default. An image (Backend.advertise_image) is an Image. Raises ValueError, with a one-line message, for an
        unknown field or a wrong value.
        """

    def subscribers(self) -> int:
        """Return the number of subscribers; 0 also if messages published here are not sent."""

    def shutdown(self) -> None:
        """Stop advertising."""


# Returns the response to a request; the second argument converts a script's answer to a response. Raises Unanswered.
Ask = Callable[[Any, Callable[[Any], Any]], Any]


class Backend(Protocol):
    """Transport of messages to and from other programs, such as rospy. Topic names are complete: '/drone/front'.

    Types have the form 'geometry_msgs/Twist'. Every function is called in the simulation's thread, and raises
    ValueError, with a one-line message, for a type that is not installed.
    """

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Call `take` with every message, from any thread; return a function that ends the subscription.

        A message is an object with the fields as attributes, such as one of rospy, or a mapping.
        """

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> MessageSender:
        """Advertise a topic of any installed type."""

    def time(self) -> float:
        """Return the current time for stamps of messages, in s."""

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Broadcast frames, each with the fields of geometry_msgs/TransformStamped."""

    def parameter(self, name: str) -> Any:
        """Return a parameter by its full name, None if it is not set."""

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter by its full name."""

    def delete_parameter(self, name: str) -> None:
        """Delete a parameter, if it is set."""

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Call a service. Raises ValueError, with a one-line message, if it does not answer or fails."""

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Offer a service of any installed type; return a function that ends the service.

        Any thread may call `ask` with a request and a function that converts the script's fields to a response; `ask`
        returns the response. Raises ValueError also for a name that this process already offers.
        """

    def advertise_image(self, topic: str, queue: int) -> MessageSender:
        """Advertise a sensor_msgs/Image topic; its MessageSender publishes Image tuples."""
