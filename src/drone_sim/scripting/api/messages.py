"""Topics as a child script sees them, `simROS`, with or without ROS behind.

Whoever has a message leaves it here from any thread; the simulation hands it to the script's callback
at the start of its next step. What a script publishes is kept in `published`, and goes to the Backend
where there is one: that is the seam to ROS.
"""

from __future__ import annotations

import copy
import re
import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from drone_sim.scripting.api.calls import Function, WrongValue
from drone_sim.scripting.api.script_values import refuse_if_too_large

# The names by which messages say what is expected.
Name = str
Handle = int
Callback = str | Callable[[Any], None]

_KEPT = 32  # published messages
_MOST = 200  # subscriptions and publishers
_LONGEST_QUEUE = 1000  # messages
_OWN_TOPICS = {"cmd_vel": "geometry_msgs/Twist"}
_NONE: list[Callback] = []
_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*")


class Sender(Protocol):
    """One advertised topic of a backend."""

    def publish(self, message: Any) -> None:
        """Send a message; the simulation's thread calls it.

        It is what the script gave: a mapping of field names (nested; arrays are sequences, strings are
        str, or bytes where they are no UTF-8; times are numbers of seconds), or an object with the fields
        as attributes. A field left out keeps its default. An image (Backend.advertise_image) is an Image.
        Raises ValueError, in one line, for a field that does not exist or does not fit.
        """

    def shutdown(self) -> None:
        """Stop advertising."""


class Backend(Protocol):
    """What carries messages to and from others, such as rospy. Topics come resolved: '/drone/front'.

    Types are written as ROS does: 'geometry_msgs/Twist'. Every function is called in the simulation's
    thread, and raises ValueError, in one line, for a type that is not installed.
    """

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Call `take` with every message, from any thread; return what ends that.

        A message is an object with the fields as attributes (rospy's own will do), or a mapping.
        """

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> Sender:
        """Advertise a topic of any installed type."""

    def advertise_image(self, topic: str, queue: int) -> Sender:
        """Advertise a sensor_msgs/Image; its Sender takes Image tuples."""


class Image(NamedTuple):
    """A picture that a script publishes: rgb8, the top row first, as sensor_msgs/Image has it."""

    data: bytes
    width: int
    height: int
    frame_id: str


class Published(NamedTuple):
    """A message that a script published."""

    topic: str
    kind: str
    message: Any


class _Subscription(NamedTuple):
    topic: str
    callback: Callback
    messages: deque[Any]
    begin: Callable[[], Callable[[], None]]  # returns what ends it
    end: Callable[[], None]


class _Publisher(NamedTuple):
    topic: str
    kind: str
    begin: Callable[[], Sender | None]
    sender: Sender | None


class MessageBus:
    """What one drone's script subscribes to and publishes; relative names stand in the drone's namespace.

    `backend` may be set at any time; it serves what is subscribed and advertised after that. Topics in
    `own_topics` are never asked of it: the drone itself posts them.
    """

    def __init__(self, namespace: str, own_topics: Mapping[str, str] | None = None):
        """Take the drone's namespace, such as 'drone', and topics that the drone posts itself, with their types."""
        self.backend: Backend | None = None
        self.published: deque[Published] = deque(maxlen=_KEPT)
        self._namespace = namespace
        own = _OWN_TOPICS if own_topics is None else own_topics
        self._own_topics = {self._resolve(topic): kind for topic, kind in own.items()}
        self._new_callbacks: list[Callback] = []
        self._lock = threading.Lock()
        self._next_handle = 0
        self._subscriptions: dict[int, _Subscription] = {}
        self._publishers: dict[int, _Publisher] = {}

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        names = (
            "subscribe",
            "shutdownSubscriber",
            "advertise",
            "publish",
            "shutdownPublisher",
            "imageTransportAdvertise",
            "imageTransportPublish",
            "imageTransportShutdownPublisher",
        )
        return {name: getattr(self, name) for name in names}

    # ---- what a script calls

    def subscribe(self, topic: Name, kind: Name, callback: Callback, queue: int = 1, *_ignored: Any) -> int:
        """Call the script's function `callback` with each message on `topic`; return a handle.

        Of the messages that arrive during one step the last `queue` are kept; V-REP's 0 stands for 1.
        """
        resolved = self._resolve(topic)
        messages: deque[Any] = deque(maxlen=min(max(1, int(queue)), _LONGEST_QUEUE))

        def begin() -> Callable[[], None]:
            if self.backend is None or resolved in self._own_topics:
                return _nothing
            return self.backend.subscribe(resolved, kind, messages.append)

        self._refuse_if_too_many()
        self._check_type(resolved, kind)
        subscription = _Subscription(resolved, callback, messages, begin, begin())
        with self._lock:
            handle = self._new_handle()
            self._subscriptions[handle] = subscription
        self._new_callbacks.append(callback)
        return handle

    def shutdownSubscriber(self, handle: Handle) -> None:
        """End a subscription; raises ValueError where there is none of that handle."""
        with self._lock:
            subscription = self._subscriptions.pop(handle, None)
        if subscription is None:
            raise ValueError(f"no subscription has the handle {handle}")
        subscription.end()

    def advertise(self, topic: Name, kind: Name, queue: int = 1, latch: bool = False, *_ignored: Any) -> int:
        """Advertise a topic; return a handle to publish on."""
        resolved, kept = self._resolve(topic), min(max(1, int(queue)), _LONGEST_QUEUE)

        def begin() -> Sender | None:
            return self.backend.advertise(resolved, kind, kept, bool(latch)) if self.backend else None

        self._check_type(resolved, kind)
        return self._add_publisher(resolved, kind, begin)

    def publish(self, handle: Handle, message: Any) -> None:
        """Publish a message: a table of its fields."""
        publisher = self._publisher(handle)
        if message is None or isinstance(message, (str, bytes, int, float)):
            raise WrongValue("a table of the message's fields is expected")
        refuse_if_too_large(message)
        self._send(publisher, message)

    def shutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising; raises ValueError where nothing has that handle."""
        publisher = self._publisher(handle)
        del self._publishers[handle]
        if publisher.sender is not None:
            publisher.sender.shutdown()

    def imageTransportAdvertise(self, topic: Name, queue: int = 1) -> int:
        """Advertise an image topic; return a handle to publish on."""
        resolved, kept = self._resolve(topic), min(max(1, int(queue)), _LONGEST_QUEUE)

        def begin() -> Sender | None:
            return self.backend.advertise_image(resolved, kept) if self.backend else None

        return self._add_publisher(resolved, "sensor_msgs/Image", begin)

    def imageTransportPublish(self, handle: Handle, data: Any, width: int, height: int, frame_id: Name) -> None:
        """Publish a vision sensor's image as getVisionSensorCharImage returns it, the bottom row first."""
        if isinstance(data, int):
            raise WrongValue("an image is expected")
        refuse_if_too_large(data)
        pixels = data.encode("utf-8") if isinstance(data, str) else bytes(data)
        row, rows = 3 * int(width), int(height)
        if row < 0 or rows < 0:
            raise ValueError(f"an image of {width} x {height} does not exist")
        if len(pixels) != row * rows:
            raise ValueError(f"an image of {width} x {height} has {row * rows} bytes, not {len(pixels)}")
        top_first = b"".join(np.frombuffer(pixels, np.uint8).reshape(rows, row)[::-1])
        self._send(self._publisher(handle), Image(top_first, int(width), rows, frame_id))

    def imageTransportShutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising an image topic."""
        self.shutdownPublisher(handle)

    # ---- what the simulation calls

    def post(self, topic: str, message: Any) -> None:
        """Leave a message for the next step; any thread may call it."""
        resolved = self._resolve(topic)
        with self._lock:
            for subscription in self._subscriptions.values():
                if subscription.topic == resolved:
                    subscription.messages.append(message)

    def new_callbacks(self) -> list[Callback]:
        """Return what was subscribed with since the last call."""
        if not self._new_callbacks:
            return _NONE
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def deliver(self, call: Callable[[Callback, Any], None]) -> None:
        """Hand every waiting message to `call(callback, message)`, oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._subscriptions.values():  # which no other thread changes
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        for callback, message in waiting:
            call(callback, message)

    def close(self) -> None:
        """End every subscription and stop advertising: the script that made them is gone."""
        self._new_callbacks = []
        with self._lock:
            subscriptions, self._subscriptions = self._subscriptions, {}
            publishers, self._publishers = self._publishers, {}
        for subscription in subscriptions.values():
            subscription.end()
        for publisher in publishers.values():
            if publisher.sender is not None:
                publisher.sender.shutdown()

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is subscribed and advertised now, and the messages that wait."""
        subscriptions, publishers, last = dict(self._subscriptions), dict(self._publishers), self._next_handle
        waiting = {handle: _copied(one.messages) for handle, one in subscriptions.items()}

        def recall() -> None:
            for handle in set(self._subscriptions) - set(subscriptions):
                self.shutdownSubscriber(handle)
            for handle in set(self._publishers) - set(publishers):
                self.shutdownPublisher(handle)
            for handle in set(subscriptions) - set(self._subscriptions):
                subscriptions[handle] = subscriptions[handle]._replace(end=subscriptions[handle].begin())
            for handle in set(publishers) - set(self._publishers):
                publishers[handle] = publishers[handle]._replace(sender=publishers[handle].begin())
            with self._lock:
                self._subscriptions, self._publishers = {**subscriptions}, {**publishers}
                self._next_handle = last
                for handle, messages in waiting.items():
                    subscriptions[handle].messages.clear()
                    subscriptions[handle].messages.extend(_copied(messages))

        return recall

    def _add_publisher(self, topic: str, kind: str, begin: Callable[[], Sender | None]) -> int:
        self._refuse_if_too_many()
        publisher = _Publisher(topic, kind, begin, begin())
        with self._lock:
            handle = self._new_handle()
            self._publishers[handle] = publisher
        return handle

    def _check_type(self, topic: str, kind: str) -> None:
        """Raise ValueError for a type that the topic does not have, or that is none."""
        own = self._own_topics.get(topic)
        if own is not None and kind != own:
            raise ValueError(f"messages on {topic} are of the type {own}, not '{kind}'")
        if not _TYPE.fullmatch(kind):
            raise ValueError(f"'{kind:.80}' is no message type; one is, for example, geometry_msgs/Twist")

    def _refuse_if_too_many(self) -> None:
        if len(self._subscriptions) + len(self._publishers) >= _MOST:
            raise ValueError(f"a script has at most {_MOST} subscriptions and publishers")

    def _publisher(self, handle: int) -> _Publisher:
        if handle not in self._publishers:
            raise ValueError(f"no publisher has the handle {handle}")
        return self._publishers[handle]

    def _send(self, publisher: _Publisher, message: Any) -> None:
        self.published.append(Published(publisher.topic, publisher.kind, message))
        if publisher.sender is not None:
            publisher.sender.publish(message)

    def _new_handle(self) -> int:
        self._next_handle += 1
        return self._next_handle

    def _resolve(self, topic: str) -> str:
        return topic if topic.startswith("/") else f"/{self._namespace}/{topic}"


def _nothing() -> None:
    pass


def _copied(messages: deque[Any]) -> deque[Any]:
    """Return copies of messages, which a callback may change; other threads may append meanwhile."""
    kept = messages.copy()
    try:
        return copy.deepcopy(kept)
    except Exception:  # whatever a message's class raises when it is copied
        return kept
