"""Markers on one topic for rviz: made while somebody listens, and not more often than eyes need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import rospy
from geometry_msgs.msg import Point, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.ros.core.message_conversion import BASE_LINK, WORLD_FRAME, frame, xyz
from drone_sim.ros.core.publishing import NewSubscribers
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle

EYES = 0.03  # s of real time, between two messages about what moves
_SETTLED = 3.0  # s, after which rviz has started
WORDS = 0.19  # s, between two texts: numbers that change faster cannot be read


_Point = TypeVar("_Point")


def namespace(simulation: Simulation) -> str:
    """Return where the topics on all that flies are: in the only vehicle's namespace, or in the node's."""
    alone = [one.name for one in simulation.vehicles.values() if one.parameters.is_alone]
    return alone[0] if alone else str(rospy.get_name())


class MarkerTopic:
    """A latched MarkerArray, in the frame `world` unless a marker has another; ids are places in the list."""

    def __init__(self, topic: str, period: float):
        """Advertise `topic`; `period` is in s of real time."""
        self._name = topic.rpartition("/")[2]
        self._throttle = Throttle(period)
        self._new_subscribers = NewSubscribers()
        self._publisher = rospy.Publisher(
            topic, MarkerArray, subscriber_listener=self._new_subscribers, queue_size=1, latch=True
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
        if self._new_subscribers.have_settled(_SETTLED) and self._shown:
            self._publisher.publish(MarkerArray(self._shown))

    def show(self, markers: Sequence[Marker | None]) -> None:
        """Publish; None deletes the marker with that id, and so does a list that is shorter than the last one."""
        shown = [marker or Marker(action=Marker.DELETE) for marker in markers]
        if not shown or shown[0].action != Marker.DELETEALL:
            shown += [Marker(action=Marker.DELETE) for _ in self._shown[len(shown) :]]
        for number, marker in enumerate(shown):
            marker.header.frame_id, marker.id = marker.header.frame_id or WORLD_FRAME, number
            before = self._shown[number].ns if number < len(self._shown) else ""
            marker.ns = marker.ns or (marker.action == Marker.DELETE and before) or self._name
        self._shown = shown
        self._publisher.publish(MarkerArray(shown))


class FleetMarkers:
    """What is drawn of each vehicle, on a topic `view/NAME`: anew where it has changed, while somebody listens."""

    name = ""
    period = EYES  # s of real time

    def __init__(self, simulation: Simulation):
        """Advertise for the vehicles of `simulation`."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/{self.name}", self.period)
        self._shown: list[Any] = []

    def update(self) -> None:
        """Publish what has changed, if anybody listens."""
        if not self._topic.due():
            return
        vehicles = list(self._simulation.vehicles.values())
        seen = [self._look(vehicle) for vehicle in vehicles]
        if seen != self._shown:
            self._shown = seen
            self._topic.show([one for pair in zip(vehicles, seen) for one in self._draw(*pair)])

    def _look(self, vehicle: Vehicle) -> Any:
        """Return what its markers are made of."""
        raise NotImplementedError

    def _draw(self, vehicle: Vehicle, seen: Any) -> Sequence[Marker | None]:
        """Return its markers: always as many, None for what is not there."""
        raise NotImplementedError


def new_marker(
    kind: int, rgba: Sequence[float], scale: Sequence[float], points: Sequence[Sequence[float]] = (), ns: str = ""
) -> Marker:
    """Return a marker at the world's origin, of points in m where its kind has some, in the namespace `ns`."""
    points = [Point(*one) for one in points]
    marker = Marker(type=kind, ns=ns, color=ColorRGBA(*rgba), scale=Vector3(*scale), points=points)
    marker.pose.orientation.w = 1.0
    return marker


def fan(middle: _Point, rim: Sequence[_Point]) -> list[_Point]:
    """Return the triangles from a point to the sides of a closed rim, corner by corner."""
    return [corner for one, other in zip(rim, [*rim[1:], rim[0]]) for corner in (middle, one, other)]


def band(left: Sequence[_Point], right: Sequence[_Point]) -> list[_Point]:
    """Return the triangles between two lines of as many points, corner by corner."""
    squares = zip(left, right, right[1:], left[1:])
    return [corner for a, b, c, d in squares for corner in (a, b, c, a, c, d)]


def beside(vehicle: Vehicle, marker: Marker) -> Marker:
    """Let a marker, which is given in world axes from the vehicle's place, follow the vehicle in rviz.

    It is attached to the vehicle's frame and turned back upright: rviz shows it where the vehicle is now, but a marker
    in `world` where the vehicle was when it was sent.
    """
    back = frames.invert(frames.from_quaternion((0, 0, 0), vehicle.body.state.orientation))
    marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
    marker.pose.position = Point(*frames.rotate(back, xyz(marker.pose.position)))
    marker.pose.orientation = Quaternion(*frames.to_quaternion(back))
    return marker
