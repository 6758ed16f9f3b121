"""Handles in rviz: the green target spheres, and the vehicles themselves, to be dragged with the mouse in flight.

A vehicle stands still while somebody holds its handle: its propellers do not pull against the mouse. When it is
released, it flies on from there, at rest.
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

_PERIOD = 0.19  # s of real time, between two updates: five a second are enough for handles


class _Handle(NamedTuple):
    """What a handle moves: a vehicle, or its green sphere."""

    vehicle: str
    object: str
    is_target: bool
    limits: VehicleParameters  # callbacks read nothing of the simulation


class VehicleHandles:
    """An interactive marker server at `markers`, with a ring for every vehicle and a ball for its green sphere."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Show those for the vehicles of `simulation`, whose thread empties `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle = Throttle(_PERIOD)
        self._topic = f"{namespace(simulation)}/markers/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/markers")
        self._looks = {True: new_marker(Marker.SPHERE, (0.0, 0.8, 0.0, 0.9), [0.12] * 3), False: _ring()}
        self._shown: dict[str, _Handle] = {}
        self._holding: set[str] = set()  # the handles whose vehicles stand still
        self._show(self._wanted())
        self._server.applyChanges()

    def update(self) -> None:
        """Let go of the vehicles that nobody holds any more; let the handles follow what they stand for."""
        for name in self._holding - self._held.names():
            self._let_go(name)
        if not self._server.watched or not self._throttle.passes():
            return
        self._show(self._wanted())
        objects = self._simulation.context.objects
        for name in self._shown.keys() - self._held.names():
            matrix = objects.matrix(objects.handle(self._shown[name].object))
            self._server.setPose(name, message_conversion.pose(level(matrix)))
        self._server.applyChanges()

    def _wanted(self) -> dict[str, _Handle]:
        """Return the handles by name; a sphere only after a script has detached it: before, it would hide the drone."""
        wanted = {}
        for vehicle in self._simulation.vehicles.values():
            own, alone = vehicle.parameters, vehicle.parameters.is_alone
            drone, target = DRONE + vehicle.suffix, TARGET + vehicle.suffix
            wanted[DRONE if alone else vehicle.name] = _Handle(vehicle.name, drone, False, own)
            objects = vehicle.context.objects
            if objects[objects.handle(target)].parent is None:
                wanted[TARGET if alone else f"{vehicle.name}/target"] = _Handle(vehicle.name, target, True, own)
        return wanted

    def _show(self, wanted: dict[str, _Handle]) -> None:
        for name in wanted.keys() - self._shown.keys():
            self._server.insert(new_handle(name, [self._looks[wanted[name].is_target]]), self._on_feedback)
        for name in self._shown.keys() - wanted.keys():
            self._server.erase(name)
        self._shown = wanted

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.on_feedback(feedback)
        handle = self._shown.get(feedback.marker_name)
        if handle is None:  # it has gone meanwhile
            return
        done = None if handle.is_target else intervention(MOVE, handle.vehicle, self._topic, feedback)
        if feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN:
            self._inbox.put(lambda: self._hold(feedback.marker_name, handle), done)
        if feedback.event_type != InteractiveMarkerFeedback.POSE_UPDATE:
            return
        try:
            pose = read_pose(feedback.header.frame_id, feedback.pose, handle.limits)
        except checks.Refused:
            return  # dragged below the floor, or to the horizon: it stays where it was
        self._inbox.put(lambda: self._carry_out(feedback.marker_name, handle, pose), done)

    def _carry_out(self, name: str, handle: _Handle, pose: Pose) -> None:
        self._hold(name, handle)  # after a restart it would be free
        vehicle = self._simulation.vehicles.get(handle.vehicle)  # it may have gone, or be another one, meanwhile
        if vehicle is not None:
            vehicle.target.put(pose.matrix) if handle.is_target else vehicle.body.move(pose)

    def _hold(self, name: str, handle: _Handle) -> None:
        """Let a vehicle stand still whose handle somebody still holds."""
        vehicle = self._simulation.vehicles.get(handle.vehicle)
        if vehicle is not None and not handle.is_target and name in self._held.names():
            self._holding.add(name)
            vehicle.body.hold()

    def _let_go(self, name: str) -> None:
        self._holding.discard(name)
        vehicle = self._simulation.vehicles.get(self._shown[name].vehicle) if name in self._shown else None
        if vehicle is not None:
            vehicle.body.let_go()


def _ring() -> Marker:
    """Return a flat ring around the drone, wide enough to be caught and not in the way of what is inside it."""
    angles = [2 * math.pi * index / 48 for index in range(49)]
    inner, outer = ([(r * math.cos(a), r * math.sin(a), 0.0) for a in angles] for r in (0.22, 0.26))
    ring = new_marker(Marker.TRIANGLE_LIST, (1.0, 0.6, 0.0, 0.45), (1, 1, 1), band(inner, outer))
    ring.colors = [ring.color] * len(ring.points)  # lights it from everywhere
    return ring
