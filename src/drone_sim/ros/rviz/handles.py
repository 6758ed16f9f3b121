"""Handles in rviz: the green target spheres, and the vehicles themselves, to be dragged with the mouse in flight."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerFeedback, Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.rviz.held import Held
from drone_sim.ros.rviz.marker_topic import namespace
from drone_sim.ros.vehicle.inputs import checked_pose
from drone_sim.ros.vehicle.messages import WORLD_FRAME
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import checks
from drone_sim.vehicles.quadricopter_objects import DRONE, TARGET

_PERIOD = 0.19  # s of real time, between two updates: five a second are enough for handles
_UPRIGHT = Quaternion(0, 2**-0.5, 0, 2**-0.5)  # a control acts along, about, or across its x axis: turned to z


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
        self._server = _Server(f"{namespace(simulation)}/markers")
        self._looks = {True: _ball(), False: _ring()}
        self._shown: dict[str, _Handle] = {}
        self._show(self._wanted())
        self._server.applyChanges()

    def update(self) -> None:
        """Let the handles follow what they stand for, unless they are being dragged."""
        if not self._server.update_pub.get_num_connections() or not self._throttle.passes():
            return
        self._show(self._wanted())
        objects = self._simulation.drone.objects
        for name in self._shown.keys() - self._held.names():
            matrix = objects.matrix(objects.handle(self._shown[name].object))
            yaw = frames.to_euler(matrix)[2]
            level = frames.from_euler(frames.position(matrix), (0, 0, yaw))
            self._server.setPose(name, _pose(level))
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
            self._server.insert(_handle(name, self._looks[wanted[name].is_target]), self._on_feedback)
        for name in self._shown.keys() - wanted.keys():
            self._server.erase(name)
        self._shown = wanted

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        name, client = feedback.marker_name, feedback.client_id
        if feedback.event_type == InteractiveMarkerFeedback.MOUSE_DOWN:
            self._held.take(name, client)
        elif feedback.event_type == InteractiveMarkerFeedback.MOUSE_UP:
            self._held.let_go(name, client)
        else:
            self._held.keep(name, client)
        if feedback.event_type == InteractiveMarkerFeedback.POSE_UPDATE:
            self._move(name, feedback)

    def _move(self, name: str, feedback: InteractiveMarkerFeedback) -> None:
        handle = self._shown.get(name)
        vehicle = self._simulation.vehicles.get(handle.vehicle) if handle else None
        if handle is None or vehicle is None:  # it has gone meanwhile
            return
        try:
            pose = checked_pose(feedback.header.frame_id, feedback.pose, vehicle.parameters)
        except checks.Refused:
            return  # dragged below the floor, or to the horizon: it stays where it was
        self._inbox.put(lambda: vehicle.move_target(pose) if handle.is_target else vehicle.move(pose))


class _Server(InteractiveMarkerServer):
    """Its timer may still publish while rospy closes the topic, as the node ends; there is nobody left to tell."""

    def publish(self, update: Any) -> None:
        """Publish, or not any more."""
        try:
            super().publish(update)
        except rospy.ROSException:
            if not rospy.is_shutdown():
                raise


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


def _handle(name: str, look: Marker) -> InteractiveMarker:
    """Return a handle that slides level when its body is dragged, and has an arrow up and a ring to turn it."""
    handle = InteractiveMarker(name=name, scale=0.5)
    handle.header.frame_id = WORLD_FRAME
    slide = InteractiveMarkerControl(name="slide", orientation=_UPRIGHT, always_visible=True)
    slide.interaction_mode = InteractiveMarkerControl.MOVE_PLANE
    slide.markers.append(look)
    lift = InteractiveMarkerControl(name="lift", orientation=_UPRIGHT)
    lift.interaction_mode = InteractiveMarkerControl.MOVE_AXIS
    turn = InteractiveMarkerControl(name="turn", orientation=_UPRIGHT)
    turn.interaction_mode = InteractiveMarkerControl.ROTATE_AXIS
    handle.controls = [slide, lift, turn]
    return handle


def _pose(matrix: Matrix) -> Pose:
    return Pose(Point(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))
