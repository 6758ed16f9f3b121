"""Wireless data between scripts, as in V-REP 3.x."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field

from drone_sim.scripting.api.types import MOST_BYTES, Text

_MOST = 10_000  # waiting broadcasts


@dataclass(frozen=True)
class Broadcast:
    """Data from a script to another, or to sim.handle_all, _tree or _chain, which can be received until a time in s."""

    sender: int
    target: int
    header: int
    name: str
    data: Text
    antenna: int
    radius: float  # m
    angles: tuple[float, float]  # rad, vertical and horizontal
    until: float
    received_by: set[int] = field(default_factory=set)


class Broadcasts:
    """The broadcasts that can still be received."""

    def __init__(self) -> None:
        self.sent: list[Broadcast] = []

    def clear(self) -> None:
        """Remove all, as at the beginning of a run."""
        self.sent = []

    def send(self, broadcast: Broadcast) -> None:
        """Send data. Raises ValueError if too many are waiting."""
        if len(self.sent) >= _MOST or sum(len(item.data) for item in (broadcast, *self.sent)) > MOST_BYTES:
            raise ValueError(
                f"more than {_MOST} messages or {MOST_BYTES} bytes are waiting: let them persist for a shorter time"
            )
        self.sent.append(broadcast)

    def waiting(self, time: float) -> list[Broadcast]:
        """Return the broadcasts that can be received at a simulated time, oldest first; remove the others."""
        self.sent = [broadcast for broadcast in self.sent if time <= broadcast.until]
        return self.sent

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores the present broadcasts."""
        kept = copy.deepcopy(self.sent)

        def restore() -> None:
            self.sent = copy.deepcopy(kept)

        return restore
