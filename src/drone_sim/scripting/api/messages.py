"""Topics as a child script sees them, `simROS`, with or without ROS behind.

Whoever has a message leaves it here from any thread; the simulation hands it to the script's callback
at the start of its next step. What a script publishes goes to the Backend where there is one, else nowhere.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drone_sim.scripting.api.backend import Backend, Image, Sender
from drone_sim.scripting.api.calls import Function, WrongValue
from drone_sim.scripting.api.offered_services import OfferedServices
from drone_sim.scripting.api.publishers import Begin, Kept, Publishers
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.subscriptions import Subscriptions
from drone_sim.scripting.api.types import Callback, Handle, Name

_MOST = 200  # subscriptions and publishers
_LONGEST_QUEUE = 1000  # messages
_OWN_TOPICS = {
    "cmd_vel": "geometry_msgs/Twist",
    **dict.fromkeys(("takeoff", "land", "reset", "home"), "std_msgs/Empty"),
    "goto": "geometry_msgs/PoseStamped",
    "state": "std_msgs/String",
    "parameter_updates": "dynamic_reconfigure/Config",
}
_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*")


class MessageBus:
    """What one drone's script subscribes to and publishes; relative names stand in the drone's namespace.

    `backend` may be set at any time; it serves what is subscribed and advertised after that. Topics in
    `own_topics` are never asked of it: the drone itself posts them, and hears what is published on them.
    """

    def __init__(self, namespace: str, own_topics: Mapping[str, str] | None = None):
        """Take the namespace ('drone', '' is none), and topics that the drone itself has, with their types."""
        self.backend: Backend | None = None
        self._prefix = f"/{namespace}" if namespace else ""
        own = _OWN_TOPICS if own_topics is None else own_topics
        self._own_topics = {self.resolve(topic): kind for topic, kind in own.items()}
        self._subscriptions = Subscriptions()
        # Asked for in every step: without another call in between.
        self.new_callbacks, self.deliver = self._subscriptions.new_callbacks, self._subscriptions.deliver
        self.take = self._subscriptions.take
        self._publishers = Publishers()
        self.said: dict[str, Any] = {}  # what was last published on own topics, by their full names
        self._last_handle = 0

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        names = (
            "subscribe",
            "shutdownSubscriber",
            "advertise",
            "publish",
            "shutdownPublisher",
            "getNumSubscribers",
            "publisherTreatUInt8ArrayAsString",
            "subscriberTreatUInt8ArrayAsString",
            "imageTransportAdvertise",
            "imageTransportPublish",
            "imageTransportShutdownPublisher",
        )
        offering = OfferedServices(self._subscriptions, self._new_handle, self.resolve, lambda: self.backend)
        return {**{name: getattr(self, name) for name in names}, **offering.functions()}

    # ---- what a script calls

    def subscribe(self, topic: Name, kind: Name, callback: Callback, queue: int = 1, *_ignored: Any) -> int:
        """Call the script's function `callback` with each message on `topic`; return a handle.

        Of the messages that arrive during one step the last `queue` are kept; V-REP's 0 stands for 1. The same
        topic, type and callback once more give the handle that they have; V-REP calls back once more for each.
        """
        resolved, kept = self.resolve(topic), _length(queue)
        there = self._subscriptions.same(resolved, kind, callback)
        if there is not None:
            return there

        def begin(take: Callable[[Any], None]) -> Callable[[], None]:
            if self.backend is None or resolved in self._own_topics:
                return _nothing
            return self.backend.subscribe(resolved, kind, take)

        self._check_type(resolved, kind)
        handle = self._new_handle()
        self._subscriptions.add(handle, resolved, kind, callback, kept, begin)
        return handle

    def shutdownSubscriber(self, handle: Handle) -> None:
        """End a subscription; raises ValueError where there is none of that handle."""
        self._subscriptions.check(handle)
        self._subscriptions.end(handle)

    def advertise(self, topic: Name, kind: Name, queue: int = 1, latch: bool = False, *_ignored: Any) -> int:
        """Advertise a topic; return a handle to publish on."""
        resolved, kept = self.resolve(topic), _length(queue)

        def begin() -> Sender | None:
            if resolved in self._own_topics:
                return Kept(self.said, resolved)
            return self.backend.advertise(resolved, kind, kept, bool(latch)) if self.backend else None

        self._check_type(resolved, kind)
        return self._add_publisher(begin)

    def publish(self, handle: Handle, message: Any) -> None:
        """Publish a message: a table of its fields."""
        if message is None or isinstance(message, (str, bytes, int, float)):
            raise WrongValue("a table of the message's fields is expected")
        refuse_if_too_large(message)
        self._publishers.send(handle, message)

    def shutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising; raises ValueError where nothing has that handle."""
        self._publishers.end(handle)

    def getNumSubscribers(self, handle: Handle) -> int:
        """Return how many listen to what is published; V-REP has no such function."""
        return self._publishers.subscribers(handle)

    def publisherTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] goes as a string or a table anyhow."""
        self._publishers.subscribers(handle)

    def subscriberTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] arrives as a string anyhow; string.byte(data, 1) is its first byte."""
        self._subscriptions.check(handle)

    def imageTransportAdvertise(self, topic: Name, queue: int = 1) -> int:
        """Advertise an image topic; return a handle to publish on."""
        resolved, kept = self.resolve(topic), _length(queue)

        def begin() -> Sender | None:
            return self.backend.advertise_image(resolved, kept) if self.backend else None

        return self._add_publisher(begin)

    def imageTransportPublish(self, handle: Handle, data: Any, width: int, height: int, frame_id: Name) -> None:
        """Publish a vision sensor's image as getVisionSensorCharImage returns it, the bottom row first."""
        self._publishers.send(handle, Image(_top_row_first(data, width, height), int(width), int(height), frame_id))

    def imageTransportShutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising an image topic."""
        self._publishers.end(handle)

    # ---- what the simulation calls

    @property
    def is_subscribed(self) -> bool:
        """Whether there is any subscription."""
        return len(self._subscriptions) > 0

    def post(self, topic: str, message: Any) -> None:
        """Leave a message for the next step; any thread may call it."""
        self._subscriptions.post(self.resolve(topic), message)

    def hears(self, topic: str) -> bool:
        """Whether the script is subscribed to a topic."""
        return self._subscriptions.has(self.resolve(topic))

    def close(self) -> None:
        """End every subscription and stop advertising: the script that made them is gone."""
        self._subscriptions.close()
        self._publishers.close()

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is subscribed and advertised now, and the messages that wait."""
        last, recalls = self._last_handle, (self._subscriptions.remember(), self._publishers.remember())
        said = dict(self.said)

        def recall() -> None:
            for one in recalls:
                one()
            self._last_handle = last
            self.said.clear()
            self.said.update(said)

        return recall

    def _add_publisher(self, begin: Begin) -> int:
        handle = self._new_handle()
        self._publishers.add(handle, begin)
        return handle

    def _check_type(self, topic: str, kind: str) -> None:
        """Raise ValueError for a type that the topic does not have, or that is none."""
        own = self._own_topics.get(topic)
        if own is not None and kind != own:
            raise ValueError(f"messages on {topic} are of the type {own}, not '{kind}'")
        if not _TYPE.fullmatch(kind):
            raise ValueError(f"'{kind:.80}' is no message type; one is, for example, geometry_msgs/Twist")

    def _new_handle(self) -> int:
        if len(self._subscriptions) + len(self._publishers) >= _MOST:
            raise ValueError(f"a script has at most {_MOST} subscriptions and publishers")
        self._last_handle += 1
        return self._last_handle

    def resolve(self, topic: str) -> str:
        """Return the full name of a topic or parameter: a relative one stands in the drone's namespace."""
        return topic if topic.startswith("/") else f"{self._prefix}/{topic}"


def _nothing() -> None:
    pass


def _length(queue: int) -> int:
    return min(max(1, int(queue)), _LONGEST_QUEUE)


def _top_row_first(data: Any, width: int, height: int) -> bytes:
    """Return an image turned over; raises WrongValue, ValueError for what is none of that size."""
    if isinstance(data, int):
        raise WrongValue("an image is expected")
    refuse_if_too_large(data)
    pixels = data.encode("utf-8") if isinstance(data, str) else bytes(data)
    row, rows = 3 * int(width), int(height)
    if row < 0 or rows < 0:
        raise ValueError(f"an image of {width} x {height} does not exist")
    if len(pixels) != row * rows:
        raise ValueError(f"an image of {width} x {height} has {row * rows} bytes, not {len(pixels)}")
    return b"".join(np.frombuffer(pixels, np.uint8).reshape(rows, row)[::-1])
