"""What a vehicle is asked for besides twists, and what its script says of its state: a layer that scripts may have."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import Any

from drone_sim.scripting.api.messages import MessageBus

_LOG = logging.getLogger(__name__)

UNKNOWN = "unknown"
LANDED, CRASHED = "landed", "crashed"  # in which no command moves it
_TOPIC = "state"


class FlightState:
    """Hands requests to the scripts of a vehicle that offer to answer them."""

    def __init__(self, buses: Callable[[], Iterable[MessageBus]]):
        """Take what returns the buses of its scripts, its own one first."""
        self._buses = buses
        self.begin()

    def begin(self) -> None:
        """Forget what was asked in vain: another script may be there."""
        self._missing = ""
        self._dropped: set[str] = set()

    def __str__(self) -> str:
        """Return the state, as a script says it; `unknown` where none does."""
        for bus in self._buses():
            said = bus.said and bus.said.get(bus.resolve(_TOPIC))
            if said:
                return str(said.get("data", said) if isinstance(said, dict) else said)
        return self._missing or UNKNOWN

    def ask(self, topic: str, message: Any, before: Callable[[], None] = lambda: None) -> None:
        """Call `before`, and leave the message for the next step; where no script listens, say so instead."""
        hearing = [bus for bus in self._buses() if bus.hears(topic)]
        if hearing:
            before()
        elif not self._missing:
            self._missing = f"{UNKNOWN}: the script does not subscribe to {topic}"
            _LOG.warning("%s: nothing happens: the child script does not subscribe to it; `pilot` does", topic)
        for bus in hearing:
            bus.post(topic, message)

    def drop(self, topic: str) -> None:
        """Say that a request comes to nothing while the simulation is stopped: once for each topic and stop."""
        if topic not in self._dropped:
            self._dropped.add(topic)
            _LOG.warning("%s: nothing happens: the simulation is stopped; `start` it first", topic)
