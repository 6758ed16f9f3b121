"""Which commands a vehicle got from whom, and which were refused: for people who ask why it does not fly."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

_ALTERNATING = 4  # changes of the sender within _RECENT, after which several senders send at the same time
_RECENT = 3.0  # s


class Taken(NamedTuple):
    """The last good message of a topic."""

    sender: str
    at: float  # s, of the log's clock


class Refusal(NamedTuple):
    """The last message of a topic that was refused."""

    topic: str
    sender: str
    at: float  # s, of the log's clock
    why: str
    times: int  # of those refused by now


class CommandLog:
    """The messages received for one vehicle since it was added. Any thread may write, and any may read."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, senders: Callable[[], list[str]] = list):
        """Begin empty; take a monotonic `clock` (s), and what returns the `senders` that are connected."""
        self.clock, self.senders = clock, senders
        self.taken: dict[str, Taken] = {}  # by topic
        self.refused: dict[str, Refusal] = {}
        self._changes: dict[str, deque[Taken]] = {}  # by topic: the last messages from another sender than before
        self._lock = threading.Lock()

    def take(self, topic: str, sender: str) -> None:
        """Note a good message."""
        before, now = self.taken.get(topic), Taken(sender, self.clock())
        self.taken[topic] = now
        if before is None or before.sender != sender:
            self._changes.setdefault(topic, deque(maxlen=_ALTERNATING)).append(now)

    def rivals(self, topic: str) -> list[str]:
        """Return the senders whose messages on a topic alternate; none, if one took over from the other just once."""
        changes = list(self._changes.get(topic, ()))
        if len(changes) < _ALTERNATING or self.clock() - changes[0].at > _RECENT:
            return []
        return sorted({one.sender for one in changes})

    def refuse(self, topic: str, sender: str, why: str) -> None:
        """Note one that was refused."""
        with self._lock:
            before = self.refused.get(topic)
            self.refused[topic] = Refusal(topic, sender, self.clock(), why, before.times + 1 if before else 1)

    def last_refusal(self) -> Refusal | None:
        """Return the latest refusal on any topic."""
        with self._lock:
            return max(self.refused.values(), key=lambda one: one.at, default=None)

    def is_refusing(self, topic: str) -> bool:
        """Whether the last message of a topic was refused."""
        refused, taken = self.refused.get(topic), self.taken.get(topic)
        return refused is not None and (taken is None or taken.at < refused.at)
