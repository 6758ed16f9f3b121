"""Topics as a child script sees them, `simROS`, with or without ROS behind.

Whoever has a message leaves it here from any thread; the simulation hands it to the script's callback
at the start of its next step.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Any, Callable, Deque, Dict, List, Tuple


class MessageBus:
    """What one drone's script subscribes to; relative names stand in the drone's namespace."""

    def __init__(self, namespace: str):
        """Take the drone's namespace, such as 'drone'."""
        self._namespace = namespace
        self._lock = threading.Lock()
        self._next_handle = 0
        self._subscriptions: Dict[int, Tuple[str, str, Deque[Any]]] = {}

    def subscribe(self, topic: str, _type: str, callback: str, queue: int = 1, *_ignored: Any) -> int:
        """Call the script's function `callback` with each message on `topic`; return a handle.

        Of the messages that arrive during one step the last `queue` are kept; V-REP's 0 stands for 1.
        """
        with self._lock:
            self._next_handle += 1
            messages: Deque[Any] = deque(maxlen=max(1, int(queue)))
            self._subscriptions[self._next_handle] = (self._resolve(topic), callback, messages)
            return self._next_handle

    def shutdownSubscriber(self, handle: int) -> None:
        """End a subscription; raises ValueError where there is none of that handle."""
        with self._lock:
            if self._subscriptions.pop(handle, None) is None:
                raise ValueError(f"no subscription has the handle {handle}")

    def post(self, topic: str, message: Any) -> None:
        """Leave a message for the next step; any thread may call it."""
        with self._lock:
            for subscribed, _, messages in self._subscriptions.values():
                if subscribed == self._resolve(topic):
                    messages.append(message)

    def deliver(self, call: Callable[[str, Any], None]) -> None:
        """Hand every waiting message to `call(callback, message)`, oldest first."""
        waiting: List[Tuple[str, Any]] = []
        with self._lock:
            for _, callback, messages in self._subscriptions.values():
                waiting += [(callback, message) for message in messages]
                messages.clear()
        for callback, message in waiting:
            call(callback, message)

    def _resolve(self, topic: str) -> str:
        return topic if topic.startswith("/") else f"/{self._namespace}/{topic}"
