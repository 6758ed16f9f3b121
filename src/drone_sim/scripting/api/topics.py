"""The topics and services that one script subscribes to and offers, by handle, and what waits there."""

from __future__ import annotations

import copy
import functools
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.service_servers import ServiceRequest, carry_out
from drone_sim.scripting.api.types import Callback

Begin = Callable[[Callable[[Any], None]], Callable[[], None]]  # takes what takes messages, returns what ends it
_NONE: list[Callback] = []
SERVICE = "service {}"  # instead of a topic, whose full name begins with a slash


class OwnTopic:
    """Sender for a topic that the drone itself receives; a Backend sends the other topics."""

    def __init__(self, said: dict[str, Any], topic: str):
        """`said` is where the last message of the `topic` is left."""
        self._said, self._topic = said, topic

    def publish(self, message: Any) -> None:
        """Leave a message."""
        self._said[self._topic] = message

    def subscribers(self) -> int:
        """Return how many listen: the drone."""
        return 1

    def shutdown(self) -> None:
        """Forget what was said."""
        self._said.pop(self._topic, None)


class _Subscription(NamedTuple):
    topic: str
    kind: str
    callback: Callback
    messages: deque[Any]
    begin: Begin
    end: Callable[[], None]


class Subscriptions:
    """Subscriptions by handle. One thread owns them; any other may leave a message."""

    def __init__(self) -> None:
        """Start with none."""
        self._by_handle: dict[int, _Subscription] = {}
        self._lock = threading.Lock()
        self._new_callbacks: list[Callback] = []

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._by_handle)

    def same(self, topic: str, kind: str, callback: Callback) -> int | None:
        """Return the handle of the subscription of a callback to a topic of a type, None where there is none."""
        for handle, one in self._by_handle.items():
            if one.topic == topic and one.kind == kind and _are_same(one.callback, callback):
                return handle
        return None

    def add(self, handle: int, topic: str, kind: str, callback: Callback, queue: int, begin: Begin) -> None:
        """Subscribe to a topic, or offer a service, of a type; of what waits the last `queue` are kept."""
        messages: deque[Any] = deque(maxlen=queue)
        subscription = _Subscription(topic, kind, callback, messages, begin, begin(messages.append))
        with self._lock:
            self._by_handle[handle] = subscription
        self._new_callbacks.append(callback)

    def check(self, handle: int, is_service: bool) -> None:
        """Raise ValueError where no subscription to a topic, or no service that is offered, has that handle."""
        if handle not in self._by_handle or self._by_handle[handle].topic.startswith("/") == is_service:
            what = "service that the script offers" if is_service else "subscription"
            raise ValueError(f"there is no {what} with the handle {handle}")

    def end(self, handle: int) -> None:
        """End a subscription; raises ValueError where there is none of that handle."""
        with self._lock:
            subscription = self._by_handle.pop(handle, None)
        if subscription is None:
            raise ValueError(f"there is no subscription with the handle {handle}")
        subscription.end()

    def close(self) -> None:
        """End all of them."""
        self._new_callbacks = []
        for handle in list(self._by_handle):
            self.end(handle)

    def post(self, topic: str, message: Any) -> None:
        """Leave a message; any thread may call it."""
        with self._lock:
            for subscription in self._by_handle.values():
                if subscription.topic == topic:
                    subscription.messages.append(message)

    def has(self, topic: str) -> bool:
        """Whether there is one to that topic, or that service is offered; any thread may call it."""
        with self._lock:
            return any(one.topic == topic for one in self._by_handle.values())

    def new_callbacks(self) -> list[Callback]:
        """Return the callbacks of the subscriptions since the last call."""
        if not self._new_callbacks:
            return _NONE
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def deliver(self, script: Script) -> None:
        """Hand over every waiting message and request, of each subscription the oldest first."""
        for callback, message in self.take():
            if type(message) is ServiceRequest:
                carry_out(message, functools.partial(script.answer, callback))
            else:
                script.callback(callback, message)

    def take(self) -> list[tuple[Callback, Any]]:
        """Return the messages and requests that wait, and whom each is for; of each subscription the oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._by_handle.values():  # which no other thread changes
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        return waiting

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back what is subscribed to now, and the messages that wait."""
        kept = dict(self._by_handle)
        waiting = {handle: _copied(one.messages) for handle, one in kept.items()}

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


def _are_same(one: Callback, other: Callback) -> bool:
    """Tell whether two callbacks are the same function: by its name, or itself."""
    return one == other if isinstance(one, str) and isinstance(other, str) else one is other


def _copied(messages: deque[Any]) -> deque[Any]:
    """Return copies of messages, which a callback may change; other threads may append meanwhile."""
    kept = messages.copy()
    try:
        return copy.deepcopy(kept)
    except Exception:  # whatever a message's class raises when it is copied
        return kept
