"""Markers on one topic for rviz: made while somebody listens, and not more often than eyes need."""

from __future__ import annotations

from typing import Optional, Sequence

import rospy
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.pacing import Throttle
from drone_sim.ros.messages import WORLD

EYES = 0.03  # s of real time, between two messages about what moves
WORDS = 0.19  # s, between two texts: numbers that change faster cannot be read


class MarkerTopic:
    """A latched MarkerArray in the frame `world`; a marker's place in it is its id."""

    def __init__(self, topic: str, period: float):
        """Advertise; `period` is in s of real time."""
        self._name = topic.rpartition("/")[2]
        self._throttle = Throttle(period)
        self._publisher = rospy.Publisher(topic, MarkerArray, queue_size=1, latch=True)

    @property
    def watched(self) -> bool:
        """Whether somebody listens."""
        return bool(self._publisher.get_num_connections())

    def due(self) -> bool:
        """Tell whether it is time for another message; it counts as sent then."""
        return self.watched and self._throttle.passes()

    def show(self, markers: Sequence[Optional[Marker]]) -> None:
        """Publish; None takes away what may be shown in that place."""
        message = MarkerArray([marker or Marker(action=Marker.DELETE) for marker in markers])
        for number, marker in enumerate(message.markers):
            marker.header.frame_id, marker.ns, marker.id = WORLD, marker.ns or self._name, number
        self._publisher.publish(message)


def shape(kind: int, rgba: Sequence[float], scale: Sequence[float], points: Sequence[Sequence[float]] = ()) -> Marker:
    """Return a marker at the world's origin, of points in m where its kind has some."""
    marker = Marker(type=kind, color=ColorRGBA(*rgba), scale=Vector3(*scale), points=[Point(*one) for one in points])
    marker.pose.orientation.w = 1.0
    return marker
