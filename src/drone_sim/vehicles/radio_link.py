"""A radio link such as a drone's Wi-Fi, in simulated time: messages are delayed or lost.

A message sent at t is lost with the probability `loss`; otherwise it arrives at t + latency + jitter u, u uniform in
[-1, 1], but not before t. The receiver gets the newest message: those that a later one has overtaken are discarded, as
in drones that number their messages (the commands of Parrot's AR.Drone).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Generic, TypeVar

import numpy as np

from drone_sim.config.types import Checked, Finite, Fraction, Within
from drone_sim.mechanics.saved_state import Restore, in_turn, saved

_ON_TIME = 1e-9  # s; tolerance for rounding errors of summed times

_Message = TypeVar("_Message")
_Seconds = Annotated[Finite, Within(0, 2)]


class LinkParameters(Checked):
    """`latency` and `jitter` in s of simulated time; `loss` is the fraction of messages that are lost."""

    latency: _Seconds
    jitter: _Seconds
    loss: Fraction

    @property
    def is_perfect(self) -> bool:
        """Whether messages are neither delayed nor lost."""
        return not (self.latency or self.jitter or self.loss)


@dataclass(frozen=True)
class _Sent(Generic[_Message]):  # not a NamedTuple: Python 3.10 has no generic ones
    at: float  # s
    due: float  # s
    what: _Message


class RadioLink(Generic[_Message]):
    """One direction of a link, for one stream of messages."""

    def __init__(self, parameters: LinkParameters, seed: Sequence[int], buffer: int):
        """Create a link; `seed` must differ from that of every other link.

        If more than `buffer` messages are on the link, the oldest are lost.
        """
        self.parameters = parameters  # may be replaced; applies to messages sent afterwards
        self._random = np.random.default_rng(np.random.SeedSequence(list(seed)))
        self._under_way: deque[_Sent[_Message]] = deque(maxlen=buffer)

    def send(self, now: float, what: _Message) -> None:
        """Send a message at `now` (s)."""
        parameters = self.parameters
        luck, late = map(float, self._random.random(2))  # draw both, so that a loss changes no later message
        if luck >= parameters.loss:
            delay = max(0.0, parameters.latency + parameters.jitter * (2 * late - 1))
            self._under_way.append(_Sent(now, now + delay, what))

    def receive(self, now: float) -> tuple[float, _Message] | None:
        """Return age (s) and content of the newest message that has arrived by `now` (s); None if none is new."""
        arrived = [number for number, sent in enumerate(self._under_way) if sent.due <= now + _ON_TIME]
        if not arrived:
            return None
        newest = self._under_way[arrived[-1]]
        for _ in range(arrived[-1] + 1):
            self._under_way.popleft()
        return now - newest.at, newest.what

    def save_state(self) -> Restore:
        """Return a function that restores the messages on the link and the random state."""
        return in_turn(saved(self, "parameters", "_under_way"), saved(self._random.bit_generator, "state"))
