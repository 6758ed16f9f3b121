"""Subscriptions, publications and services of a script, with or without ROS.

Any thread may post a message here; at the beginning of its next step, the simulation passes it to the script's
callback. The script's publications are sent by the Backend, if there is one.
"""

from __future__ import annotations

import copy
import functools
import logging
import re
import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drone_sim.mechanics.saved_state import Restore
from drone_sim.scripting.api.backend import Backend, MessageSender
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.service_servers import ServiceRequest, ServiceServer, execute
from drone_sim.scripting.api.types import Callback

_LOG = logging.getLogger(__name__)

_MOST = 200  # subscriptions and publishers
_LONGEST_QUEUE = 1000  # messages
_MOST_WAITING = 100  # waiting requests of one service
_OWN_TOPICS = {
    "cmd_vel": "geometry_msgs/Twist",
    **dict.fromkeys(("takeoff", "land", "emergency", "reset", "home"), "std_msgs/Empty"),
    "goto": "geometry_msgs/PoseStamped",
    "state": "std_msgs/String",
    "parameter_updates": "dynamic_reconfigure/Config",
}
_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*")
_NAME = re.compile(r"(/[A-Za-z0-9_]+)+")  # like rosgraph.names.is_legal_name for complete names, but ASCII only
# Called with a message handler; returns a function that ends the subscription.
Begin = Callable[[Callable[[Any], None]], Callable[[], None]]
_SERVICE = "service {}"  # stored in place of a topic, whose name begins with a slash


class _Subscription(NamedTuple):
    topic: str
    kind: str
    callback: Callback
    messages: deque[Any]
    begin: Begin
    end: Callable[[], None]


class _Publisher(NamedTuple):
    begin: Callable[[], MessageSender | None]  # returns None without a backend
    sender: MessageSender | None


class MessageBus:
    """Subscriptions, publications and services of one script.

    `backend` may be set at any time, and is used for later subscriptions and publications. It is not used for the
    topics in `own_topics`, which the drone itself posts and receives.
    """

    def __init__(self, namespace: str, own_topics: Mapping[str, str] | None = None):
        """`namespace`: such as 'drone', '' for none; `own_topics`: types of the drone's own topics by name."""
        self.backend: Backend | None = None
        self._prefix = f"/{namespace}" if namespace else ""
        own = _OWN_TOPICS if own_topics is None else own_topics
        self._own_topics = {self.resolve(topic): kind for topic, kind in own.items()}
        self._subscriptions: dict[int, _Subscription] = {}  # by handle
        self._lock = threading.Lock()  # one thread owns the subscriptions; any thread may post a message
        self._new_callbacks: list[Callback] = []
        self._publishers: dict[int, _Publisher] = {}
        self.own_messages: dict[str, Any] = {}  # the last message on each of the drone's own topics, by complete name
        self._last_handle = 0

    # ---- for scripts

    def subscribe(self, topic: str, kind: str, callback: Callback, queue: int = 1) -> int:
        """Subscribe to a topic; in each step, the last `queue` messages are kept. Return a handle. Raises ValueError.

        A second call with the same topic, type and callback returns the same handle.
        """
        resolved = self.resolved("topic", topic)
        for handle, existing in self._subscriptions.items():
            is_same_topic = existing.topic == resolved and existing.kind == kind
            if is_same_topic and _are_same(existing.callback, callback):
                return handle

        def begin(take: Callable[[Any], None]) -> Callable[[], None]:
            if resolved in self._own_topics:
                return _nothing
            if self.backend is None:
                _LOG.warning("%s: no message will be received, because this flight runs without ROS", resolved)
                return _nothing
            return self.backend.subscribe(resolved, kind, take)

        self._check_type(resolved, kind)
        return self._add_subscription(resolved, kind, callback, _length(queue), begin)

    def offer(self, name: str, kind: str, callback: Callback) -> int:
        """Offer a service whose requests a callback answers; return a handle. Raises ValueError."""
        service = self.resolved("service", name)
        if self._has_subscription(_SERVICE.format(service)):
            raise ValueError(f"this script already offers the service {service}")
        if not _TYPE.fullmatch(kind):
            raise ValueError(f"'{kind:.80}' is not a service type, such as std_srvs/Trigger")

        def begin(take: Callable[[Any], None]) -> Callable[[], None]:
            if self.backend is None:
                return _nothing
            server = ServiceServer(take)
            end = self.backend.serve(service, kind, server.ask)

            def close() -> None:
                server.close()  # refuses waiting requests
                end()

            return close

        return self._add_subscription(_SERVICE.format(service), kind, callback, _MOST_WAITING, begin)

    def advertise(self, topic: str, kind: str, queue: int = 1, latch: bool = False) -> int:
        """Advertise a topic; return a handle. Raises ValueError."""
        resolved = self.resolved("topic", topic)

        def begin() -> MessageSender | None:
            if resolved in self._own_topics:
                return OwnTopic(self.own_messages, resolved)
            return self.backend.advertise(resolved, kind, _length(queue), latch) if self.backend else None

        self._check_type(resolved, kind)
        return self._add_publisher(begin)

    def advertise_image(self, topic: str, queue: int = 1) -> int:
        """Advertise a topic of images; return a handle. Raises ValueError."""
        resolved = self.resolved("topic", topic)
        return self._add_publisher(
            lambda: self.backend.advertise_image(resolved, _length(queue)) if self.backend else None
        )

    def publish(self, handle: int, message: Any) -> None:
        """Publish a message. Raises ValueError for an unknown handle."""
        sender = self._sender(handle)
        if sender is not None:
            sender.publish(message)

    def subscribers(self, handle: int) -> int:
        """Return the number of subscribers. Raises ValueError for an unknown handle."""
        sender = self._sender(handle)
        return 0 if sender is None else sender.subscribers()

    def end_publisher(self, handle: int) -> None:
        """Stop advertising. Raises ValueError for an unknown handle."""
        sender = self._sender(handle)
        del self._publishers[handle]
        if sender is not None:
            sender.shutdown()

    def check_subscription(self, handle: int, is_service: bool = False) -> None:
        """Raise ValueError if no subscription (or no offered service) has this handle."""
        if handle not in self._subscriptions or self._subscriptions[handle].topic.startswith("/") == is_service:
            what = "service that the script offers" if is_service else "subscription"
            raise ValueError(f"there is no {what} with the handle {handle}")

    def end_subscription(self, handle: int, is_service: bool = False) -> None:
        """End a subscription or an offered service. Raises ValueError for an unknown handle."""
        self.check_subscription(handle, is_service)
        self._end(handle)

    # ---- for the simulation

    @property
    def is_subscribed(self) -> bool:
        return bool(self._subscriptions)

    def post(self, topic: str, message: Any) -> None:
        """Store a message for the next step; any thread may call this."""
        resolved = self.resolve(topic)
        with self._lock:
            for subscription in self._subscriptions.values():
                if subscription.topic == resolved:
                    subscription.messages.append(message)

    def hears(self, topic: str) -> bool:
        """Return whether the script is subscribed to a topic."""
        return self._has_subscription(self.resolve(topic))

    def new_callbacks(self) -> list[Callback]:
        """Return the callbacks of the subscriptions that were added since the last call."""
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def check_callbacks(self, script: Script) -> None:
        """Raise ScriptError if the script has subscribed with the name of a function that does not exist."""
        for callback in self.new_callbacks():
            script.check(callback)

    def deliver(self, script: Script) -> None:
        """Check new callbacks, then pass every waiting message and request to the script.

        For each subscription the oldest message is first. Raises ScriptError.
        """
        if self._new_callbacks:
            self.check_callbacks(script)
        for callback, message in self.take():
            if type(message) is ServiceRequest:
                execute(message, functools.partial(script.answer, callback))
            else:
                script.callback(callback, message)

    def take(self) -> list[tuple[Callback, Any]]:
        """Return and remove waiting messages and requests, with callbacks; for each subscription, the oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._subscriptions.values():  # not changed by other threads
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        return waiting

    def close(self) -> None:
        """End all subscriptions, services and publications."""
        self._new_callbacks = []
        for handle in list(self._subscriptions):
            self._end(handle)
        for handle in list(self._publishers):
            self.end_publisher(handle)

    def save_state(self) -> Restore:
        """Return a function that restores the present subscriptions, publications and waiting messages."""
        subscriptions, kept = dict(self._subscriptions), dict(self._publishers)
        waiting = {handle: _copied(subscription.messages) for handle, subscription in subscriptions.items()}
        last, kept_messages = self._last_handle, dict(self.own_messages)

        def restore() -> None:
            for handle in set(self._subscriptions) - set(subscriptions):
                self._end(handle)
            for handle in set(subscriptions) - set(self._subscriptions):
                ended = subscriptions[handle]
                subscriptions[handle] = ended._replace(end=ended.begin(ended.messages.append))
            with self._lock:
                self._subscriptions = dict(subscriptions)
                for handle, messages in waiting.items():
                    subscriptions[handle].messages.clear()
                    subscriptions[handle].messages.extend(_copied(messages))
            for handle in set(self._publishers) - set(kept):
                self.end_publisher(handle)
            for handle in set(kept) - set(self._publishers):
                kept[handle] = kept[handle]._replace(sender=kept[handle].begin())
            self._publishers = dict(kept)
            self._last_handle = last
            self.own_messages.clear()
            self.own_messages.update(kept_messages)

        return restore

    def _add_subscription(self, topic: str, kind: str, callback: Callback, queue: int, begin: Begin) -> int:
        """Subscribe to a topic, or offer a service; the last `queue` messages are kept. Return a handle."""
        handle, messages = self._new_handle(), deque[Any](maxlen=queue)
        subscription = _Subscription(topic, kind, callback, messages, begin, begin(messages.append))
        with self._lock:
            self._subscriptions[handle] = subscription
        self._new_callbacks.append(callback)
        return handle

    def _has_subscription(self, topic: str) -> bool:
        with self._lock:
            return any(subscription.topic == topic for subscription in self._subscriptions.values())

    def _end(self, handle: int) -> None:
        with self._lock:
            subscription = self._subscriptions.pop(handle)
        subscription.end()

    def _add_publisher(self, begin: Callable[[], MessageSender | None]) -> int:
        handle = self._new_handle()
        self._publishers[handle] = _Publisher(begin, begin())
        return handle

    def _sender(self, handle: int) -> MessageSender | None:
        if handle not in self._publishers:
            raise ValueError(f"there is no publisher with the handle {handle}")
        return self._publishers[handle].sender

    def _check_type(self, topic: str, kind: str) -> None:
        """Raise ValueError if the type is malformed, or differs from the type of the drone's own topic."""
        own = self._own_topics.get(topic)
        if own is not None and kind != own:
            raise ValueError(f"messages on {topic} have the type {own}, not '{kind}'")
        if not _TYPE.fullmatch(kind):
            raise ValueError(f"'{kind:.80}' is not a message type, such as geometry_msgs/Twist")

    def _new_handle(self) -> int:
        if len(self._subscriptions) + len(self._publishers) >= _MOST:
            raise ValueError(f"a script may have at most {_MOST} subscriptions and publishers")
        self._last_handle += 1
        return self._last_handle

    def resolved(self, what: str, name: str) -> str:
        """Return the complete name of a topic, service or parameter (`what`). Raises ValueError for an invalid name."""
        full = self.resolve(name)
        if not _NAME.fullmatch(full):
            raise ValueError(f"{name[:80]!r} is no name of a {what}: letters, digits, _ and / are allowed")
        return full

    def resolve(self, topic: str) -> str:
        """Return the complete name of a topic or parameter; relative names are in the drone's namespace."""
        return topic if topic.startswith("/") else f"{self._prefix}/{topic}"


def _nothing() -> None:
    pass


def _length(queue: int) -> int:
    return min(max(1, int(queue)), _LONGEST_QUEUE)


class OwnTopic:
    """Sender for a topic that the drone itself receives; a Backend sends all other topics."""

    def __init__(self, messages: dict[str, Any], topic: str):
        """The last message is stored in `messages` under `topic`."""
        self._messages, self._topic = messages, topic

    def publish(self, message: Any) -> None:
        self._messages[self._topic] = message

    def subscribers(self) -> int:
        """Return the number of subscribers: 1, because without ROS only the drone can listen."""
        return 1

    def shutdown(self) -> None:
        self._messages.pop(self._topic, None)


def _are_same(first: Callback, second: Callback) -> bool:
    """Return whether two callbacks have the same name, or are the same function."""
    return first == second if isinstance(first, str) and isinstance(second, str) else first is second


def _copied(messages: deque[Any]) -> deque[Any]:
    """Return deep copies of messages, because callbacks may change messages; other threads may append meanwhile."""
    kept = messages.copy()
    try:
        return copy.deepcopy(kept)
    except Exception:  # any exception that a message's class raises when it is copied
        return kept
