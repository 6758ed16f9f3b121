"""What a script is subscribed to, and the messages that wait for it."""

from __future__ import annotations

import copy
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.scripting.api.types import Callback

Begin = Callable[[Callable[[Any], None]], Callable[[], None]]  # takes what takes messages, returns what ends it
_NONE: list[Callback] = []


class _Subscription(NamedTuple):
    topic: str
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

    def add(self, handle: int, topic: str, callback: Callback, queue: int, begin: Begin) -> None:
        """Subscribe to a topic; of the messages that wait the last `queue` are kept."""
        messages: deque[Any] = deque(maxlen=queue)
        subscription = _Subscription(topic, callback, messages, begin, begin(messages.append))
        with self._lock:
            self._by_handle[handle] = subscription
        self._new_callbacks.append(callback)

    def find(self, topic: str, callback: Callback) -> int | None:
        """Return the handle of a subscription of a callback to a topic, None where there is none."""
        found = (handle for handle, one in self._by_handle.items() if (one.topic, one.callback) == (topic, callback))
        return next(found, None)

    def check(self, handle: int) -> None:
        """Raise ValueError where no subscription has that handle."""
        if handle not in self._by_handle:
            raise ValueError(f"no subscription has the handle {handle}")

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

    def new_callbacks(self) -> list[Callback]:
        """Return what was subscribed with since the last call."""
        if not self._new_callbacks:
            return _NONE
        new, self._new_callbacks = self._new_callbacks, []
        return new

    def deliver(self, call: Callable[[Callback, Any], None]) -> None:
        """Hand every waiting message to `call(callback, message)`, oldest first."""
        waiting: list[tuple[Callback, Any]] = []
        for subscription in self._by_handle.values():  # which no other thread changes
            while subscription.messages:
                waiting.append((subscription.callback, subscription.messages.popleft()))
        for callback, message in waiting:
            call(callback, message)

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


def _copied(messages: deque[Any]) -> deque[Any]:
    """Return copies of messages, which a callback may change; other threads may append meanwhile."""
    kept = messages.copy()
    try:
        return copy.deepcopy(kept)
    except Exception:  # whatever a message's class raises when it is copied
        return kept
