"""What a script advertises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.scripting.api.backend import Sender

Begin = Callable[[], Sender | None]  # nothing where there is no backend


class _Publisher(NamedTuple):
    begin: Begin
    sender: Sender | None


class Kept:
    """Takes what is published where the drone itself hears it, beside the topics of a Backend."""

    def __init__(self, said: dict[str, Any], topic: str):
        """Take where the last message of the topic is left."""
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


class Publishers:
    """Advertised topics by handle."""

    def __init__(self) -> None:
        """Start with none."""
        self._by_handle: dict[int, _Publisher] = {}

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._by_handle)

    def add(self, handle: int, begin: Begin) -> None:
        """Advertise a topic."""
        self._by_handle[handle] = _Publisher(begin, begin())

    def send(self, handle: int, message: Any) -> None:
        """Publish a message; raises ValueError where nothing has that handle."""
        sender = self._publisher(handle).sender
        if sender is not None:
            sender.publish(message)

    def subscribers(self, handle: int) -> int:
        """Return how many listen; raises ValueError where nothing has that handle."""
        sender = self._publisher(handle).sender
        return 0 if sender is None else sender.subscribers()

    def end(self, handle: int) -> None:
        """Stop advertising; raises ValueError where nothing has that handle."""
        sender = self._publisher(handle).sender
        del self._by_handle[handle]
        if sender is not None:
            sender.shutdown()

    def close(self) -> None:
        """Stop advertising anything."""
        for handle in list(self._by_handle):
            self.end(handle)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is advertised now."""
        kept = dict(self._by_handle)

        def recall() -> None:
            for handle in set(self._by_handle) - set(kept):
                self.end(handle)
            for handle in set(kept) - set(self._by_handle):
                kept[handle] = kept[handle]._replace(sender=kept[handle].begin())
            self._by_handle = dict(kept)

        return recall

    def _publisher(self, handle: int) -> _Publisher:
        if handle not in self._by_handle:
            raise ValueError(f"no publisher has the handle {handle}")
        return self._by_handle[handle]
