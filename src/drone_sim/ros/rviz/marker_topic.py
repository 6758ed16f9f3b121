"""Markers on one topic for rviz: made while somebody listens, and not more often than eyes need."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import rospy
from geometry_msgs.msg import Point, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.ros.vehicle import frame_names
from drone_sim.ros.vehicle.messages import WORLD_FRAME
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle

EYES = 0.03  # s of real time, between two messages about what moves
_SETTLED = 3.0  # s, after which rviz has started
WORDS = 0.19  # s, between two texts: numbers that change faster cannot be read


class _Newcomers(rospy.SubscribeListener):  # type: ignore[misc] # rospy has no types
    """When somebody has begun to listen; rospy's threads say so."""

    def __init__(self) -> None:
        super().__init__()
        self._came: float | None = None

    def peer_subscribe(self, *_: Any) -> None:
        self._came = time.monotonic()

    def have_settled(self) -> bool:
        """Tell, once, that somebody has come a while ago."""
        settled = self._came is not None and time.monotonic() - self._came > _SETTLED
        if settled:
            self._came = None
        return settled


def namespace(simulation: Simulation) -> str:
    """Return where the topics on all that flies are: in the only vehicle's namespace, or in the node's."""
    alone = [one.name for one in simulation.vehicles.values() if one.parameters.is_alone]
    return alone[0] if alone else str(rospy.get_name())


class MarkerTopic:
    """A latched MarkerArray, in the frame `world` where its markers do not say another; their order is their id."""

    def __init__(self, topic: str, period: float):
        """Advertise; `period` is in s of real time."""
        self._name = topic.rpartition("/")[2]
        self._throttle = Throttle(period)
        self._newcomers = _Newcomers()
        self._publisher = rospy.Publisher(
            topic, MarkerArray, subscriber_listener=self._newcomers, queue_size=1, latch=True
        )
        self._shown: list[Marker] = []

    @property
    def watched(self) -> bool:
        """Whether somebody listens."""
        return bool(self._publisher.get_num_connections())

    def due(self) -> bool:
        """Tell whether it is time for another message; it counts as sent then."""
        return self.watched and self._throttle.passes()

    def repeat(self) -> None:
        """Show what stands still once more, a while after somebody has come.

        While it starts, rviz may forget what it has been sent.
        """
        if self._newcomers.have_settled() and self._shown:
            self._publisher.publish(MarkerArray(self._shown))

    def show(self, markers: Sequence[Marker | None]) -> None:
        """Publish; None takes away what may be shown in that place, and so does a shorter list at its end."""
        shown = [marker or Marker(action=Marker.DELETE) for marker in markers]
        if not shown or shown[0].action != Marker.DELETEALL:
            shown += [Marker(action=Marker.DELETE) for _ in self._shown[len(shown) :]]
        for number, marker in enumerate(shown):
            marker.header.frame_id, marker.id = marker.header.frame_id or WORLD_FRAME, number
            before = self._shown[number].ns if number < len(self._shown) else ""
            marker.ns = marker.ns or (marker.action == Marker.DELETE and before) or self._name
        self._shown = shown
        self._publisher.publish(MarkerArray(shown))


def new_marker(
    kind: int, rgba: Sequence[float], scale: Sequence[float], points: Sequence[Sequence[float]] = ()
) -> Marker:
    """Return a marker at the world's origin, of points in m where its kind has some."""
    marker = Marker(type=kind, color=ColorRGBA(*rgba), scale=Vector3(*scale), points=[Point(*one) for one in points])
    marker.pose.orientation.w = 1.0
    return marker


def beside(vehicle: Vehicle, marker: Marker) -> Marker:
    """Let a marker, which is given in world axes from the vehicle's place, follow the vehicle in rviz.

    It hangs on the vehicle's frame, turned back upright: rviz shows that where it is by now, and a marker in the
    world where it was when it was sent.
    """
    back = frames.invert(frames.from_quaternion((0, 0, 0), vehicle.state.orientation))
    marker.header.frame_id, marker.frame_locked = frame_names.base_link(vehicle.parameters), True
    place = marker.pose.position
    marker.pose.position = Point(*frames.rotate(back, (place.x, place.y, place.z)))
    marker.pose.orientation = Quaternion(*frames.to_quaternion(back))
    return marker
