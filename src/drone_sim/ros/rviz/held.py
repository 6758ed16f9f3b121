"""Which handles somebody holds with the mouse."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from visualization_msgs.msg import InteractiveMarkerFeedback

PATIENCE = 1.0  # s; while a handle is held, rviz says so every 0.25 s


class Held:
    """The handles that clients hold; one of which nothing has been heard for PATIENCE has let go, or has died.

    Any thread may call all of it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """Begin with none; take a monotonic clock."""
        self._clock = clock
        self._lock = threading.Lock()
        self._heard: dict[tuple[str, str], float] = {}  # by handle and client, s

    def hear(self, feedback: InteractiveMarkerFeedback) -> None:
        """Take what a client tells of a handle."""
        name, client = feedback.marker_name, feedback.client_id
        if feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN:
            self.take(name, client)
        elif feedback.event_type == InteractiveMarkerFeedback.MOUSE_UP:
            self.let_go(name, client)
        else:
            self.keep(name, client)

    def take(self, name: str, client: str) -> None:
        """Say that a client has taken a handle."""
        with self._lock:
            self._heard[name, client] = self._clock()

    def keep(self, name: str, client: str) -> None:
        """Say that a client that holds a handle does so still."""
        with self._lock:
            if (name, client) in self._heard:
                self._heard[name, client] = self._clock()

    def let_go(self, name: str, client: str) -> None:
        """Say that a client holds it no longer."""
        with self._lock:
            self._heard.pop((name, client), None)

    def names(self) -> set[str]:
        """Return the handles that are held."""
        with self._lock:
            since = self._clock() - PATIENCE
            self._heard = {one: heard for one, heard in self._heard.items() if heard > since}
            return {name for name, _ in self._heard}
