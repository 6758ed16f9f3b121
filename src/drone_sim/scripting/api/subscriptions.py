"""What a script is subscribed to and what it offers, and the messages and requests that wait for it."""

from __future__ import annotations

import copy
import functools
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from drone_sim.scripting.api.service_servers import ServiceRequest, carry_out
from drone_sim.scripting.api.types import Callback

Begin = Callable[[Callable[[Any], None]], Callable[[], None]]  # takes what takes messages, returns what ends it
_NONE: list[Callback] = []
_SERVICE = "service {}"  # instead of a topic, whose full name begins with a slash


class Receiver(Protocol):
    """Who gets messages and requests: a script."""

    def callback(self, callback: Callback, message: Any) -> None:
        """Call a function with a message."""

    def answer(self, callback: Callback, request: Any) -> Any:
        """Call a function with a request; return what it returns."""


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
        """Subscribe to a topic of a type; of the messages that wait the last `queue` are kept."""
        messages: deque[Any] = deque(maxlen=queue)
        subscription = _Subscription(topic, kind, callback, messages, begin, begin(messages.append))
        with self._lock:
            self._by_handle[handle] = subscription
        self._new_callbacks.append(callback)

    def add_service(self, handle: int, name: str, kind: str, callback: Callback, most: int, begin: Begin) -> None:
        """Offer a service of a type, of whose requests at most so many wait."""
        self.add(handle, _SERVICE.format(name), kind, callback, most, begin)

    def serves(self, name: str) -> bool:
        """Whether a service of that name is offered."""
        return self.has(_SERVICE.format(name))

    def check(self, handle: int) -> None:
        """Raise ValueError where no subscription to a topic has that handle."""
        if handle not in self._by_handle or self._is_service(handle):
            raise ValueError(f"no subscription has the handle {handle}")

    def check_service(self, handle: int) -> None:
        """Raise ValueError where no service that is offered has that handle."""
        if handle not in self._by_handle or not self._is_service(handle):
            raise ValueError(f"no service that the script offers has the handle {handle}")

    def _is_service(self, handle: int) -> bool:
        return not self._by_handle[handle].topic.startswith("/")

    def end(self, handle: int) -> None:
        """End a subscription; raises ValueError where there is none of that handle."""
        with self._lock:
            subscription = self._by_handle.pop(handle, None)
        if subscription is None:
            raise ValueError(f"no subscription has the handle {handle}")
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
        """Whether there is one to that topic; any thread may call it."""
        with self._lock:
            return any(one.topic == topic for one in self._by_handle.values())

    def new_callbacks(self) -> list[Callback]:
        """Return what was subscribed with since the last call."""
        if not self._new_callbacks:
            return _NONE
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def deliver(self, receiver: Receiver) -> None:
        """Hand over every waiting message and request, of each subscription the oldest first."""
        for callback, message in self.take():
            if type(message) is ServiceRequest:
                carry_out(message, functools.partial(receiver.answer, callback))
            else:
                receiver.callback(callback, message)

    def take(self) -> list[tuple[Callback, Any]]:
        """Return the messages and requests that wait, and whom each is for; of each subscription the oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._by_handle.values():  # which no other thread changes
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        return waiting

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is subscribed to now, and the messages that wait."""
        kept = dict(self._by_handle)
        waiting = {handle: _copied(one.messages) for handle, one in kept.items()}

        def recall() -> None:
            for handle in set(self._by_handle) - set(kept):
                self.end(handle)
            for handle in set(kept) - set(self._by_handle):
                kept[handle] = kept[handle]._replace(end=kept[handle].begin(kept[handle].messages.append))
            with self._lock:
                self._by_handle = dict(kept)
                for handle, messages in waiting.items():
                    kept[handle].messages.clear()
                    kept[handle].messages.extend(_copied(messages))

        return recall


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
