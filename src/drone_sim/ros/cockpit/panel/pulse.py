"""Heartbeat of the cockpit: once a second, every browser is sent for how long the simulator has been silent."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rosgraph

from drone_sim.ros.core import network

_PERIOD = 1.0  # s
_SILENCE_LIMIT = 5.0  # s; while the simulator is busy, it publishes /diagnostics every 3 s only
_TIMEOUT = 0.5  # s, for the reply of the master and of the node


class Pulse(threading.Thread):
    """Sends {"pulse": {"silent", "frozen", "ended"}}; a daemon thread, so that a slow master does not delay it."""

    def __init__(self, node: str, tell: Callable[[Mapping[str, Any]], None]):
        """Watch the simulator `node`; `tell` sends a message to all browsers."""
        super().__init__(name="pulse", daemon=True)
        self._node, self._tell = node, tell
        self._heard: float | None = None  # s, monotonic; None while nothing is expected from the simulator

    def expect(self, is_there: bool) -> None:
        """Begin to expect messages from the simulator, or stop."""
        self._heard = time.monotonic() if is_there else None

    def hear(self) -> None:
        """Note that the simulator has published something. Any thread may call it."""
        if self._heard is not None:
            self._heard = time.monotonic()

    def run(self) -> None:
        """Send the heartbeat until the process ends."""
        while True:
            time.sleep(_PERIOD)
            self._tell({"pulse": self.state()})

    def state(self) -> dict[str, Any]:
        """Return for how long the simulator has been silent (s), whether that is too long, and whether it has ended."""
        heard = self._heard
        silent = 0.0 if heard is None else time.monotonic() - heard
        is_frozen = silent > _SILENCE_LIMIT
        return {"silent": round(silent, 1), "frozen": is_frozen, "ended": is_frozen and has_ended(self._node)}


def has_ended(node: str) -> bool:
    """Return whether the process of a node has ended; the master still lists a node that was killed."""
    try:
        uri = network.call(rosgraph.get_master_uri(), "lookupNode", node, timeout=_TIMEOUT)
    except ValueError:  # the master does not know it
        return True
    except network.FAILURES:
        return False
    try:
        network.call(uri, "getPid", timeout=_TIMEOUT)
    except ConnectionRefusedError:
        return True
    except network.FAILURES:  # the process is stopped, or the network is slow
        return False
    return False
