"""Log of the commands that a vehicle accepted and refused, by sender."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

_RIVAL_CHANGES = 4  # changes of the sender within _RECENT that mean that several senders are active
_RECENT = 3.0  # s


class Taken(NamedTuple):
    """Sender and time of the last accepted message on a topic."""

    sender: str
    at: float  # s, of the log's clock


class Refusal(NamedTuple):
    """The last refused message on a topic."""

    topic: str
    sender: str
    at: float  # s, of the log's clock
    why: str
    times: int  # number of refused messages so far


class CommandLog:
    """Log of the messages received for one vehicle since it was added. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, senders: Callable[[], list[str]] = list):
        """Begin empty. `clock` is monotonic (s); `senders` returns the connected senders."""
        self.clock, self.senders = clock, senders
        self.taken: dict[str, Taken] = {}  # by topic
        self.refused: dict[str, Refusal] = {}
        self._changes: dict[str, deque[Taken]] = {}  # by topic: the last messages whose sender was not the previous one
        self._moving: dict[tuple[str, str], float] = {}  # s: when a topic's sender last sent something else than zeros
        self._lock = threading.Lock()

    def take(self, topic: str, sender: str, is_zero: bool = False) -> None:
        """Log an accepted message; `is_zero` if it is a command of zeros."""
        before, now = self.taken.get(topic), Taken(sender, self.clock())
        self.taken[topic] = now
        if not is_zero:
            with self._lock:
                if (topic, sender) not in self._moving:  # those who send no more are forgotten
                    self._moving = {key: at for key, at in self._moving.items() if now.at - at <= _RECENT}
                self._moving[topic, sender] = now.at
        if before is None or before.sender != sender:
            self._changes.setdefault(topic, deque(maxlen=_RIVAL_CHANGES)).append(now)

    def rivals(self, topic: str) -> list[str]:
        """Return the senders whose messages on a topic alternate; [] if one sender only took over from another."""
        changes = list(self._changes.get(topic, ()))
        if len(changes) < _RIVAL_CHANGES or self.clock() - changes[0].at > _RECENT:
            return []
        return sorted({change.sender for change in changes})

    def sends_zeros(self, topic: str, sender: str) -> bool:
        """Return whether a sender has sent nothing but zeros for some time."""
        return self.clock() - self._moving.get((topic, sender), -math.inf) > _RECENT

    def refuse(self, topic: str, sender: str, why: str, received_on: str = "") -> None:
        """Log a refused message and the reason `why`.

        `received_on` is the topic to name if it is not `topic`: messages on cmd_vel_stamped count as cmd_vel.
        """
        with self._lock:
            before = self.refused.get(topic)
            self.refused[topic] = Refusal(
                received_on or topic, sender, self.clock(), why, before.times + 1 if before else 1
            )

    def last_refusal(self) -> Refusal | None:
        with self._lock:
            return max(self.refused.values(), key=lambda refusal: refusal.at, default=None)

    def is_refusing(self, topic: str) -> bool:
        """Return whether the last message on a topic was refused."""
        refused, taken = self.refused.get(topic), self.taken.get(topic)
        return refused is not None and (taken is None or taken.at < refused.at)
