"""Who begins to listen while nothing is published, because the simulation stands in simulated time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import genpy
import rospy

_MOST = 100  # that wait to be told

Tell = Callable[[genpy.Message], None]


class Newcomers(rospy.SubscribeListener):  # type: ignore[misc] # rospy has no types
    """Those who have begun to listen to a topic, until they are taken; rospy's threads say so."""

    def __init__(self) -> None:
        """Begin with none."""
        super().__init__()
        self._came: deque[Tell] = deque(maxlen=_MOST)

    def peer_subscribe(self, _topic: str, _publish: Tell, tell: Tell) -> None:
        """Remember somebody; rospy calls this, with what sends a message to them alone."""
        self._came.append(tell)

    def forget(self) -> None:
        """Have none: what has been published has reached them all."""
        self._came.clear()

    def take(self) -> list[Any]:
        """Return what tells each of them, and forget them. One thread alone calls this, and it publishes the topic."""
        return [self._came.popleft() for _ in range(len(self._came))]
