"""A radio link such as a drone's Wi-Fi, in simulated time: what goes over it comes later, or not at all.

A message sent at t is lost with the probability `loss`; else it is there at t + latency + jitter u, u uniform in
[-1, 1], but not before t. Whoever receives wants the newest: what a later message has overtaken is thrown away, as
drones do that number their messages (the commands of Parrot's AR.Drone).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Generic, TypeVar

import numpy as np

from drone_sim.config.types import Checked, Finite, Fraction, Within
from drone_sim.mechanics.saved_state import Restore, in_turn, saved

_ON_TIME = 1e-9  # s, by which a sum of decimal fractions misses the step it means

_What = TypeVar("_What")
_Seconds = Annotated[Finite, Within(0, 2)]


class LinkParameters(Checked):
    """`latency` and `jitter` in s of simulated time; `loss` is the share of messages that are lost."""

    latency: _Seconds
    jitter: _Seconds
    loss: Fraction

    @property
    def is_perfect(self) -> bool:
        """Whether it is as if there were no link."""
        return not (self.latency or self.jitter or self.loss)


@dataclass(frozen=True)
class _Sent(Generic[_What]):  # no NamedTuple: Python 3.10 has none that are generic
    at: float  # s
    due: float  # s
    what: _What


class RadioLink(Generic[_What]):
    """One direction of a link, for one stream of messages."""

    def __init__(self, parameters: LinkParameters, seed: Sequence[int], buffer: int):
        """Take what it is like, a seed that no other link has, and how many messages may be under way.

        Of more the oldest are lost.
        """
        self.parameters = parameters  # may be set to others: they hold for what is sent after that
        self._random = np.random.default_rng(np.random.SeedSequence(list(seed)))
        self._under_way: deque[_Sent[_What]] = deque(maxlen=buffer)

    def send(self, now: float, what: _What) -> None:
        """Send a message at `now` (s)."""
        own = self.parameters
        luck, late = map(float, self._random.random(2))  # always both: what is lost changes nothing of the others
        if luck >= own.loss:
            delay = max(0.0, own.latency + own.jitter * (2 * late - 1))
            self._under_way.append(_Sent(now, now + delay, what))

    def receive(self, now: float) -> tuple[float, _What] | None:
        """Return the newest message that has come by `now` (s), and its age in s; None where no new one has."""
        came = [number for number, one in enumerate(self._under_way) if one.due <= now + _ON_TIME]
        if not came:
            return None
        newest = self._under_way[came[-1]]
        for _ in range(came[-1] + 1):
            self._under_way.popleft()
        return now - newest.at, newest.what

    def save_state(self) -> Restore:
        """Return a function that brings back what is under way, and what will be lost."""
        return in_turn(saved(self, "parameters", "_under_way"), saved(self._random.bit_generator, "state"))
