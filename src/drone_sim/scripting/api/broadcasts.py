"""Data on their way from script to script without wires, as V-REP 3.x has them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field

from drone_sim.scripting.api.script_values import MOST_BYTES
from drone_sim.scripting.api.types import Text

_MOST = 10_000  # that wait


@dataclass(frozen=True)
class Broadcast:
    """Data on their way: from a script to one, or to sim.handle_all, _tree or _chain, until a time in s."""

    sender: int
    target: int
    header: int
    name: str
    data: Text
    antenna: int
    radius: float  # m
    angles: tuple[float, float]  # rad, up and down, and to both sides
    until: float
    received_by: set[int] = field(default_factory=set)


class Broadcasts:
    """What has been sent and may still be received."""

    def __init__(self) -> None:
        """Start with nothing."""
        self.sent: list[Broadcast] = []

    def clear(self) -> None:
        """Forget all, as at the beginning of a run."""
        self.sent = []

    def send(self, broadcast: Broadcast) -> None:
        """Send data; raises ValueError for more than may wait."""
        if len(self.sent) >= _MOST or sum(len(one.data) for one in (broadcast, *self.sent)) > MOST_BYTES:
            raise ValueError(
                f"more than {_MOST} messages or {MOST_BYTES} bytes are waiting: let them persist for a shorter time"
            )
        self.sent.append(broadcast)

    def waiting(self, time: float) -> list[Broadcast]:
        """Return what may be received at a simulated time, the oldest first; forget the rest."""
        self.sent = [one for one in self.sent if time <= one.until]
        return self.sent

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back what waits now."""
        kept = copy.deepcopy(self.sent)

        def restore() -> None:
            self.sent = copy.deepcopy(kept)

        return restore
