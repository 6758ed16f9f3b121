"""Topics of markers for rviz, which are drawn only if there are subscribers, with a limited rate; and their shapes."""

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

MOTION_PERIOD = 0.03  # s of real time, between two messages with moving markers
TEXT_PERIOD = 0.19  # s, between two texts: numbers that change faster cannot be read
_START_TIME = 3.0  # s, within which rviz starts
_Point = TypeVar("_Point")


def namespace(simulation: Simulation) -> str:
    """Return the namespace of topics about all vehicles: that of the only vehicle, or the node's."""
    alone = [vehicle.name for vehicle in simulation.vehicles.values() if vehicle.parameters.is_alone]
    return alone[0] if alone else str(rospy.get_name())


class MarkerTopic:
    """A latched MarkerArray. Markers without a frame are in `world`; their ids are their indices in the list."""

    def __init__(self, topic: str, period: float):
        """Advertise `topic`; `period` between two messages is in s of real time."""
        self._name = topic.rpartition("/")[2]
        self._throttle = Throttle(period)
        self._new_subscribers = NewSubscribers()
        self._publisher = rospy.Publisher(
            topic, MarkerArray, subscriber_listener=self._new_subscribers, queue_size=1, latch=True
        )
        self._published: list[Marker] = []

    @property
    def has_subscribers(self) -> bool:
        return bool(self._publisher.get_num_connections())

    def is_due(self) -> bool:
        """Return whether there are subscribers and the period has passed; if so, a new period begins."""
        return self.has_subscribers and self._throttle.passes()

    def repeat(self) -> None:
        """Publish the last message again, _START_TIME after a subscriber has come: rviz loses messages at its start."""
        if self._new_subscribers.have_settled(_START_TIME) and self._published:
            self._publisher.publish(MarkerArray(self._published))

    def show(self, markers: Sequence[Marker | None]) -> None:
        """Publish markers. None deletes the marker with that index; so does a list shorter than the last one."""
        message = [marker or Marker(action=Marker.DELETE) for marker in markers]
        if not message or message[0].action != Marker.DELETEALL:
            message += [Marker(action=Marker.DELETE) for _ in self._published[len(message) :]]
        for number, marker in enumerate(message):
            marker.header.frame_id, marker.id = marker.header.frame_id or WORLD_FRAME, number
            before = self._published[number].ns if number < len(self._published) else ""
            marker.ns = marker.ns or (marker.action == Marker.DELETE and before) or self._name
        self._published = message
        self._publisher.publish(MarkerArray(message))


class FleetMarkers:
    """Base class of markers for each vehicle, on the topic `view/NAME`, published when they change."""

    name = ""
    period = MOTION_PERIOD  # s of real time

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/{self.name}", self.period)
        self._published: list[Any] = []  # each vehicle, with the inputs of its markers

    def update(self) -> None:
        """Publish the markers if they have changed and there are subscribers."""
        if not self._topic.is_due():
            return
        inputs = [(vehicle, self._inputs(vehicle)) for vehicle in self._simulation.vehicles.values()]
        if inputs != self._published:
            self._published = inputs
            self._topic.show([marker for pair in inputs for marker in self._markers(*pair)])

    def _inputs(self, vehicle: Vehicle) -> Any:
        """Return the values that a vehicle's markers depend on."""
        raise NotImplementedError

    def _markers(self, vehicle: Vehicle, inputs: Any) -> Sequence[Marker | None]:
        """Return a vehicle's markers, always the same number; None for a marker that is not drawn."""
        raise NotImplementedError


def new_marker(
    kind: int, rgba: Sequence[float], scale: Sequence[float], points: Sequence[Sequence[float]] = (), ns: str = ""
) -> Marker:
    """Return a marker at its frame's origin, in the namespace `ns`; `points` (m) are for kinds that need them."""
    points = [Point(*point) for point in points]
    marker = Marker(type=kind, ns=ns, color=ColorRGBA(*rgba), scale=Vector3(*scale), points=points)
    marker.pose.orientation.w = 1.0
    return marker


def fan(middle: _Point, rim: Sequence[_Point]) -> list[_Point]:
    """Return the corners of the triangles between a point and the sides of a closed rim."""
    return [corner for first, second in zip(rim, [*rim[1:], rim[0]]) for corner in (middle, first, second)]


def band(left: Sequence[_Point], right: Sequence[_Point]) -> list[_Point]:
    """Return the corners of the triangles between two lines with the same number of points."""
    squares = zip(left, right, right[1:], left[1:])
    return [corner for a, b, c, d in squares for corner in (a, b, c, a, c, d)]


def attach_upright(vehicle: Vehicle, marker: Marker) -> Marker:
    """Attach a marker, whose pose has the vehicle's position and the world's axes, to the vehicle's frame.

    In this frame rviz draws it at the vehicle's present position; in `world`, at that of the last message.
    """
    back = frames.invert(frames.from_quaternion((0, 0, 0), vehicle.body.state.orientation))
    marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
    marker.pose.position = Point(*frames.rotate(back, xyz(marker.pose.position)))
    marker.pose.orientation = Quaternion(*frames.to_quaternion(back))
    return marker
