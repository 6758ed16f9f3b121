"""Interactive markers `markers`, by which the user drags vehicles and their green target spheres in flight.

A vehicle stands still while its handle is held, so that its propellers do not pull against the mouse. When it is
released, it flies on from its new pose, at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from visualization_msgs.msg import InteractiveMarkerFeedback, Marker

from drone_sim.grading.permissions import MOVE
from drone_sim.mechanics.state import Pose
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.validation import intervention, read_pose
from drone_sim.ros.rviz.marker_server import HeldHandles, MarkerServer, level, new_handle
from drone_sim.ros.rviz.marker_topics import band, namespace, new_marker
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE, TARGET

_PERIOD = 0.19  # s of real time, between two updates


class _Handle(NamedTuple):
    """Handle of a vehicle or of its target sphere."""

    vehicle: str
    object: str
    is_target: bool
    limits: VehicleParameters  # a copy, because callbacks must not read the simulation


class VehicleHandles:
    """A ring for each vehicle, and a ball for its target sphere."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Show the handles for the vehicles of `simulation`, whose thread runs the jobs of `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle = Throttle(_PERIOD)
        self._topic = f"{namespace(simulation)}/markers/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/markers")
        self._target_marker, self._ring = new_marker(Marker.SPHERE, (0.0, 0.8, 0.0, 0.9), [0.12] * 3), _ring()
        self._shown: dict[str, _Handle] = {}
        self._holding: set[str] = set()  # handles of vehicles that stand still
        self._show(self._handles())
        self._server.applyChanges()

    def update(self) -> None:
        """Release the vehicles that are no longer held; move the handles to their objects."""
        for name in self._holding - self._held.names():
            self._holding.discard(name)
            vehicle = self._simulation.vehicles.get(self._shown[name].vehicle) if name in self._shown else None
            if vehicle is not None:
                vehicle.body.let_go()
        if not self._server.has_subscribers or not self._throttle.passes():
            return
        self._show(self._handles())
        objects = self._simulation.context.objects
        for name in self._shown.keys() - self._held.names():
            matrix = objects.matrix(objects.handle(self._shown[name].object))
            self._server.setPose(name, message_conversion.pose(level(matrix)))
        self._server.applyChanges()

    def _handles(self) -> dict[str, _Handle]:
        """Return the handles by name. A target has one once a script has detached it; until then it is in the drone."""
        handles = {}
        for vehicle in self._simulation.vehicles.values():
            parameters, is_alone = vehicle.parameters, vehicle.parameters.is_alone
            drone, target = DRONE + vehicle.suffix, TARGET + vehicle.suffix
            handles[DRONE if is_alone else vehicle.name] = _Handle(vehicle.name, drone, False, parameters)
            objects = vehicle.context.objects
            if objects[objects.handle(target)].parent is None:
                name = TARGET if is_alone else f"{vehicle.name}/target"
                handles[name] = _Handle(vehicle.name, target, True, parameters)
        return handles

    def _show(self, handles: dict[str, _Handle]) -> None:
        for name in handles.keys() - self._shown.keys():
            marker = self._target_marker if handles[name].is_target else self._ring
            self._server.insert(new_handle(name, [marker]), self._on_feedback)
        for name in self._shown.keys() - handles.keys():
            self._server.erase(name)
        self._shown = handles

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.on_feedback(feedback)
        handle = self._shown.get(feedback.marker_name)
        if handle is None:  # the vehicle was removed meanwhile
            return
        move = None if handle.is_target else intervention(MOVE, handle.vehicle, self._topic, feedback)
        if feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN:
            self._inbox.put(lambda: self._hold(feedback.marker_name, handle), move)
        if feedback.event_type != InteractiveMarkerFeedback.POSE_UPDATE:
            return
        try:
            pose = read_pose(feedback.header.frame_id, feedback.pose, handle.limits)
        except checks.Refused:
            return  # the pose is below the floor, or too far away: the object is not moved
        self._inbox.put(lambda: self._move(feedback.marker_name, handle, pose), move)

    def _move(self, name: str, handle: _Handle, pose: Pose) -> None:
        self._hold(name, handle)  # a restart may have released the vehicle
        vehicle = self._simulation.vehicles.get(handle.vehicle)  # None if it was removed meanwhile
        if vehicle is not None:
            vehicle.target.put(pose.matrix) if handle.is_target else vehicle.body.move(pose)

    def _hold(self, name: str, handle: _Handle) -> None:
        """Keep a vehicle still if its handle is still held."""
        vehicle = self._simulation.vehicles.get(handle.vehicle)
        if vehicle is not None and not handle.is_target and name in self._held.names():
            self._holding.add(name)
            vehicle.body.hold()


def _ring() -> Marker:
    """Return a flat ring around the drone that the mouse can pick, and that does not hide the drone."""
    angles = [2 * math.pi * index / 48 for index in range(49)]
    inner, outer = ([(r * math.cos(a), r * math.sin(a), 0.0) for a in angles] for r in (0.22, 0.26))
    ring = new_marker(Marker.TRIANGLE_LIST, (1.0, 0.6, 0.0, 0.45), (1, 1, 1), band(inner, outer))
    ring.colors = [ring.color] * len(ring.points)  # rviz does not shade triangles with colors of their own
    return ring
