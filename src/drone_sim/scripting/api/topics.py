"""Subscriptions and services of a script by handle, with their waiting messages and requests."""

from __future__ import annotations

import copy
import functools
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.service_servers import ServiceRequest, execute
from drone_sim.scripting.api.types import Callback

# Called with a message handler; returns a function that ends the subscription.
Begin = Callable[[Callable[[Any], None]], Callable[[], None]]
_NONE: list[Callback] = []
SERVICE = "service {}"  # stored in place of a topic, whose name begins with a slash


class OwnTopic:
    """Sender for a topic that the drone itself receives; a Backend sends all other topics."""

    def __init__(self, messages: dict[str, Any], topic: str):
        """The last message is stored in `messages` under `topic`."""
        self._messages, self._topic = messages, topic

    def publish(self, message: Any) -> None:
        """Store a message."""
        self._messages[self._topic] = message

    def subscribers(self) -> int:
        """Return the number of subscribers: 1, because without ROS only the drone can listen."""
        return 1

    def shutdown(self) -> None:
        """Remove the message."""
        self._messages.pop(self._topic, None)


class _Subscription(NamedTuple):
    topic: str
    kind: str
    callback: Callback
    messages: deque[Any]
    begin: Begin
    end: Callable[[], None]


class Subscriptions:
    """Subscriptions by handle. One thread owns them; any thread may post a message."""

    def __init__(self) -> None:
        self._by_handle: dict[int, _Subscription] = {}
        self._lock = threading.Lock()
        self._new_callbacks: list[Callback] = []

    def __len__(self) -> int:
        """Return the number of subscriptions."""
        return len(self._by_handle)

    def same(self, topic: str, kind: str, callback: Callback) -> int | None:
        """Return the handle of an equal subscription, None if there is none."""
        for handle, subscription in self._by_handle.items():
            is_same_topic = subscription.topic == topic and subscription.kind == kind
            if is_same_topic and _are_same(subscription.callback, callback):
                return handle
        return None

    def add(self, handle: int, topic: str, kind: str, callback: Callback, queue: int, begin: Begin) -> None:
        """Subscribe to a topic, or offer a service, of a type; the last `queue` messages are kept."""
        messages: deque[Any] = deque(maxlen=queue)
        subscription = _Subscription(topic, kind, callback, messages, begin, begin(messages.append))
        with self._lock:
            self._by_handle[handle] = subscription
        self._new_callbacks.append(callback)

    def check(self, handle: int, is_service: bool) -> None:
        """Raise ValueError if no subscription (or no offered service) has this handle."""
        if handle not in self._by_handle or self._by_handle[handle].topic.startswith("/") == is_service:
            what = "service that the script offers" if is_service else "subscription"
            raise ValueError(f"there is no {what} with the handle {handle}")

    def end(self, handle: int) -> None:
        """End a subscription. Raises ValueError for an unknown handle."""
        with self._lock:
            subscription = self._by_handle.pop(handle, None)
        if subscription is None:
            raise ValueError(f"there is no subscription with the handle {handle}")
        subscription.end()

    def close(self) -> None:
        """End all subscriptions."""
        self._new_callbacks = []
        for handle in list(self._by_handle):
            self.end(handle)

    def post(self, topic: str, message: Any) -> None:
        """Post a message; any thread may call this."""
        with self._lock:
            for subscription in self._by_handle.values():
                if subscription.topic == topic:
                    subscription.messages.append(message)

    def has(self, topic: str) -> bool:
        """Return whether a topic is subscribed, or a service is offered; any thread may call this."""
        with self._lock:
            return any(subscription.topic == topic for subscription in self._by_handle.values())

    def new_callbacks(self) -> list[Callback]:
        """Return the callbacks of the subscriptions that were added since the last call."""
        if not self._new_callbacks:
            return _NONE
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def deliver(self, script: Script) -> None:
        """Pass every waiting message and request to the script, for each subscription the oldest first."""
        for callback, message in self.take():
            if type(message) is ServiceRequest:
                execute(message, functools.partial(script.answer, callback))
            else:
                script.callback(callback, message)

    def take(self) -> list[tuple[Callback, Any]]:
        """Return and remove waiting messages and requests, with callbacks; for each subscription, the oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._by_handle.values():  # not changed by other threads
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        return waiting

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores the present subscriptions and waiting messages."""
        kept = dict(self._by_handle)
        waiting = {handle: _copied(subscription.messages) for handle, subscription in kept.items()}

        def restore() -> None:
            for handle in set(self._by_handle) - set(kept):
                self.end(handle)
            for handle in set(kept) - set(self._by_handle):
                kept[handle] = kept[handle]._replace(end=kept[handle].begin(kept[handle].messages.append))
            with self._lock:
                self._by_handle = dict(kept)
                for handle, messages in waiting.items():
                    kept[handle].messages.clear()
                    kept[handle].messages.extend(_copied(messages))

        return restore


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
