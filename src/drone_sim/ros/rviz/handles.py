"""Handles in rviz: the green target spheres, and the vehicles themselves, to be dragged with the mouse in flight."""

from __future__ import annotations

import math
from typing import NamedTuple

from geometry_msgs.msg import Point
from visualization_msgs.msg import InteractiveMarkerFeedback, Marker

from drone_sim.mechanics.state import Pose
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.rviz.held import Held
from drone_sim.ros.rviz.marker_server import MarkerServer, level, new_handle, pose_message
from drone_sim.ros.rviz.marker_topic import namespace
from drone_sim.ros.vehicle.inputs import checked_pose
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.quadricopter_objects import DRONE, TARGET

_PERIOD = 0.19  # s of real time, between two updates: five a second are enough for handles


class _Handle(NamedTuple):
    """What a handle moves: a vehicle, or its green sphere."""

    vehicle: str
    object: str
    is_target: bool


class Handles:
    """An interactive marker server at `markers`, with a ring for every vehicle and a ball for its green sphere."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Show them."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = Held()
        self._throttle = Throttle(_PERIOD)
        self._server = MarkerServer(f"{namespace(simulation)}/markers")
        self._looks = {True: _ball(), False: _ring()}
        self._shown: dict[str, _Handle] = {}
        self._show(self._wanted())
        self._server.applyChanges()

    def update(self) -> None:
        """Let the handles follow what they stand for, unless they are being dragged."""
        if not self._server.watched or not self._throttle.passes():
            return
        self._show(self._wanted())
        objects = self._simulation.shared.objects
        for name in self._shown.keys() - self._held.names():
            matrix = objects.matrix(objects.handle(self._shown[name].object))
            self._server.setPose(name, pose_message(level(matrix)))
        self._server.applyChanges()

    def _wanted(self) -> dict[str, _Handle]:
        """Return the handles by name: a sphere once a script has taken it off the drone, which it would only hide."""
        wanted = {}
        for vehicle in self._simulation.vehicles.values():
            alone = vehicle.parameters.is_alone
            drone, target = DRONE + vehicle.suffix, TARGET + vehicle.suffix
            wanted[DRONE if alone else vehicle.name] = _Handle(vehicle.name, drone, False)
            if vehicle.objects[vehicle.objects.handle(target)].parent is None:
                wanted[TARGET if alone else f"{vehicle.name}/target"] = _Handle(vehicle.name, target, True)
        return wanted

    def _show(self, wanted: dict[str, _Handle]) -> None:
        for name in wanted.keys() - self._shown.keys():
            self._server.insert(new_handle(name, [self._looks[wanted[name].is_target]]), self._on_feedback)
        for name in self._shown.keys() - wanted.keys():
            self._server.erase(name)
        self._shown = wanted

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.hear(feedback)
        if feedback.event_type == InteractiveMarkerFeedback.POSE_UPDATE:
            self._move(feedback.marker_name, feedback)

    def _move(self, name: str, feedback: InteractiveMarkerFeedback) -> None:
        handle = self._shown.get(name)
        vehicle = self._simulation.vehicles.get(handle.vehicle) if handle else None
        if handle is None or vehicle is None:  # it has gone meanwhile
            return
        try:
            pose = checked_pose(feedback.header.frame_id, feedback.pose, vehicle.parameters)
        except checks.Refused:
            return  # dragged below the floor, or to the horizon: it stays where it was
        self._inbox.put(lambda: self._carry_out(handle, pose))

    def _carry_out(self, handle: _Handle, pose: Pose) -> None:
        vehicle = self._simulation.vehicles.get(handle.vehicle)  # it may have gone, or be another one, meanwhile
        if vehicle is not None:
            vehicle.move_target(pose) if handle.is_target else vehicle.move(pose)


def _ball() -> Marker:
    ball = Marker(type=Marker.SPHERE)
    ball.scale.x = ball.scale.y = ball.scale.z = 0.12
    ball.color.g, ball.color.a = 0.8, 0.9
    return ball


def _ring() -> Marker:
    """Return a flat ring around the drone, wide enough to be caught and not in the way of what is inside it."""
    ring = Marker(type=Marker.TRIANGLE_LIST)
    ring.scale.x = ring.scale.y = ring.scale.z = 1.0
    ring.color.r, ring.color.g, ring.color.a = 1.0, 0.6, 0.45
    angles = [2 * math.pi * index / 48 for index in range(49)]
    inner, outer = ([Point(r * math.cos(a), r * math.sin(a), 0.0) for a in angles] for r in (0.22, 0.26))
    for i, o, next_i, next_o in zip(inner, outer, inner[1:], outer[1:]):
        ring.points += [i, o, next_o, i, next_o, next_i]
    ring.colors = [ring.color] * len(ring.points)  # lights it from everywhere
    return ring
