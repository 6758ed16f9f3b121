"""Interactive markers by which the user drags vehicles, their target spheres and objects of the scene in flight."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import rospy
from geometry_msgs.msg import Quaternion
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerFeedback, Marker

from drone_sim.grading.permissions import MOVE
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import WORLD_FRAME
from drone_sim.ros.core.validation import intervention, read_pose
from drone_sim.ros.rviz.marker_topics import band, namespace, new_marker
from drone_sim.ros.rviz.scene_markers import bodiless_markers, marker_of
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.shapes.visual import Visual
from drone_sim.vehicles import checks
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE, TARGET

TIMEOUT = 1.0  # s; while a handle is held, rviz sends feedback every 0.25 s
_UPRIGHT = Quaternion(0, 2**-0.5, 0, 2**-0.5)  # turns a control's x axis, along or about which it acts, to z
_PERIOD = 0.19  # s of real time, between two updates
_WARNING_PERIOD = 5.0  # s, between two warnings
_ARROW_SIZES = 0.5, 5.0  # m, smallest and largest
_INVISIBLE = (0.2, 0.6, 1.0, 0.01)  # rviz does not pick a marker that is entirely transparent
_ENLARGEMENT = 1.02  # of the copy of an object, so that the mouse picks it and not the object
_Drag = InteractiveMarkerFeedback


class MarkerServer(InteractiveMarkerServer):
    """An interactive marker server whose timer may still publish while rospy closes the topic at the node's end."""

    @property
    def has_subscribers(self) -> bool:
        return bool(self.update_pub.get_num_connections())

    def publish(self, update: Any) -> None:
        """Publish; do nothing if rospy has closed the topic at the node's end."""
        try:
            super().publish(update)
        except rospy.ROSException:
            if not rospy.is_shutdown():
                raise

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Accept a new handle's first client at once: interactive_markers ignores clients in the first second."""
        context = self.marker_contexts.get(feedback.marker_name)
        if context is not None and not context.last_client_id:
            context.last_client_id = feedback.client_id
        super().processFeedback(feedback)


def new_handle(name: str, markers: Sequence[Marker], scale: float = 0.5, arrows: bool = True) -> InteractiveMarker:
    """Return a handle that slides level if its markers are dragged.

    With `arrows`, it also has arrows and a ring of size `scale` (m), by which it rises and turns.
    """
    handle = InteractiveMarker(name=name, scale=scale)
    handle.header.frame_id = WORLD_FRAME
    handle.pose.orientation.w = 1.0
    slide = InteractiveMarkerControl(name="slide", orientation=_UPRIGHT, always_visible=True)
    slide.interaction_mode = InteractiveMarkerControl.MOVE_PLANE
    slide.markers = list(markers)
    handle.controls = [slide]
    modes = {"lift": InteractiveMarkerControl.MOVE_AXIS, "turn": InteractiveMarkerControl.ROTATE_AXIS}
    for control, mode in modes.items() if arrows else ():
        handle.controls.append(InteractiveMarkerControl(name=control, orientation=_UPRIGHT, interaction_mode=mode))
    return handle


def level(matrix: Matrix) -> Matrix:
    """Return the pose of a handle for an object at `matrix`: upright, with the object's yaw."""
    return frames.from_rpy(frames.position(matrix), (0, 0, frames.to_rpy(matrix)[2]))


class HeldHandles:
    """Handles that clients hold. A client without feedback for TIMEOUT no longer holds its handle. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        """`clock` must be monotonic (s)."""
        self._clock = clock
        self._lock = threading.Lock()
        self._received_at: dict[tuple[str, str], float] = {}  # by handle and client, s

    def on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Process a client's feedback on a handle. The client holds the handle from MOUSE_DOWN on."""
        key = feedback.marker_name, feedback.client_id
        with self._lock:
            if feedback.event_type == _Drag.MOUSE_UP:
                self._received_at.pop(key, None)
            elif feedback.event_type == _Drag.MOUSE_DOWN or key in self._received_at:
                self._received_at[key] = self._clock()

    def names(self) -> set[str]:
        with self._lock:
            since = self._clock() - TIMEOUT
            self._received_at = {key: time for key, time in self._received_at.items() if time > since}
            return {name for name, _ in self._received_at}


# ---- vehicles


class _VehicleHandle(NamedTuple):
    """Handle of a vehicle or of its target sphere."""

    vehicle: str
    object: str
    is_target: bool
    limits: VehicleParameters  # a copy, because callbacks must not read the simulation


class VehicleHandles:
    """Interactive markers `markers`: a ring for each vehicle, and a ball for its target sphere.

    A vehicle stands still while its handle is held, so that its propellers do not pull against the mouse. When it is
    released, it flies on from its new pose, at rest.
    """

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Show the handles for the vehicles of `simulation`, whose thread runs the jobs of `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle = Throttle(_PERIOD)
        self._topic = f"{namespace(simulation)}/markers/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/markers")
        self._target_marker, self._ring = new_marker(Marker.SPHERE, (0.0, 0.8, 0.0, 0.9), [0.12] * 3), _ring()
        self._shown: dict[str, _VehicleHandle] = {}
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

    def _handles(self) -> dict[str, _VehicleHandle]:
        """Return the handles by name. A target has one once a script has detached it; until then it is in the drone."""
        handles = {}
        for vehicle in self._simulation.vehicles.values():
            parameters, is_alone = vehicle.parameters, vehicle.parameters.is_alone
            drone, target = DRONE + vehicle.suffix, TARGET + vehicle.suffix
            handles[DRONE if is_alone else vehicle.name] = _VehicleHandle(vehicle.name, drone, False, parameters)
            objects = vehicle.context.objects
            if objects[objects.handle(target)].parent is None:
                name = TARGET if is_alone else f"{vehicle.name}/target"
                handles[name] = _VehicleHandle(vehicle.name, target, True, parameters)
        return handles

    def _show(self, handles: dict[str, _VehicleHandle]) -> None:
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
        if feedback.event_type == _Drag.MOUSE_DOWN:
            self._inbox.put(lambda: self._hold(feedback.marker_name, handle), move)
        if feedback.event_type != _Drag.POSE_UPDATE:
            return
        try:
            pose = read_pose(feedback.header.frame_id, feedback.pose, handle.limits)
        except checks.Refused:
            return  # the pose is below the floor, or too far away: the object is not moved
        self._inbox.put(lambda: self._move(feedback.marker_name, handle, pose), move)

    def _move(self, name: str, handle: _VehicleHandle, pose: Pose) -> None:
        self._hold(name, handle)  # a restart may have released the vehicle
        vehicle = self._simulation.vehicles.get(handle.vehicle)  # None if it was removed meanwhile
        if vehicle is not None:
            vehicle.target.put(pose.matrix) if handle.is_target else vehicle.body.move(pose)

    def _hold(self, name: str, handle: _VehicleHandle) -> None:
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


# ---- objects


class _ObjectHandle(NamedTuple):
    """A handle in rviz: its appearance, its level pose in the world, and the object's pose in its frame."""

    look: Hashable
    level: Matrix
    tilt: Matrix


class ObjectHandles:
    """Interactive markers `objects`: a handle for each visible object in the scene.

    The user drags the object itself, because its handle is an invisible copy of its shape. The object that was dragged
    or clicked last also has arrows. An object stands still while it is held, and falls, or moves on, when it is
    released.
    """

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise for the scene of `simulation`, whose thread runs the jobs of `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle, self._warnings = Throttle(_PERIOD), Throttle(_WARNING_PERIOD)
        self._topic = f"{namespace(simulation)}/objects/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/objects")
        self._shown: dict[str, _ObjectHandle] = {}
        self._selected = ""

    def update(self) -> None:
        """Release the objects that are no longer held; move the handles to the other objects."""
        drag = self._simulation.scene.drag
        if drag.held:
            for name in drag.held.keys() - self._held.names():
                drag.let_go(name)
        if not self._server.has_subscribers or not self._throttle.passes():
            return
        objects = self._simulation.scene.things()
        for name in self._shown.keys() - objects.keys():
            del self._shown[name]
            self._server.erase(name)
        held = self._held.names()
        new = []
        for name, item in objects.items():
            before = self._shown.get(name)
            if before is not None and name in held:
                continue
            now = self._shown[name] = self._handle_of(item)
            if before is None or now.look != before.look:
                new.append(name)
            elif now.level != before.level:
                self._server.setPose(name, message_conversion.pose(now.level))
        if new:
            self._insert(new, objects)
        self._server.applyChanges()

    def _handle_of(self, item: SceneObject) -> _ObjectHandle:
        matrix = item.matrix()
        upright = level(matrix)
        tilt = frames.relative(upright, matrix)
        rough_tilt = tuple(round(value, 1) for value in tilt)  # a rolling object gets a new handle only now and then
        shape = getattr(item, "number", -1), getattr(item, "size", 0.0)  # the body's number changes with its size
        return _ObjectHandle((self._simulation.scene, shape, rough_tilt, item.name == self._selected), upright, tilt)

    def _insert(self, names: Sequence[str], objects: dict[str, SceneObject]) -> None:
        scene = self._simulation.scene
        visuals: dict[str, list[tuple[Visual, Matrix]]] = {name: [] for name in names}
        for name, visual, pose in zip(scene.visual_names(), *scene.visuals()):
            if name in visuals:
                visuals[name].append((visual, tuple(pose[:3].ravel().tolist())))
        for name in names:
            upright = self._shown[name].level
            markers = _invisible_copy(objects[name], visuals[name], upright)
            size = max((max(marker.scale.x, marker.scale.y, marker.scale.z) for marker in markers), default=0.0)
            arrow_size = min(max(size, _ARROW_SIZES[0]), _ARROW_SIZES[1])
            handle = new_handle(name, markers, arrow_size, arrows=name == self._selected)
            handle.pose = message_conversion.pose(upright)
            self._server.insert(handle, self._on_feedback)

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.on_feedback(feedback)
        if feedback.event_type in (_Drag.MOUSE_DOWN, _Drag.POSE_UPDATE):
            move = intervention(MOVE, feedback.marker_name, self._topic, feedback)
            self._inbox.put(lambda: self._drag(feedback), move)
        elif feedback.event_type == _Drag.MOUSE_UP:
            self._selected = feedback.marker_name

    def _drag(self, feedback: InteractiveMarkerFeedback) -> None:
        name, drag = feedback.marker_name, self._simulation.scene.drag
        shown = self._shown.get(name)
        if shown is None:  # the object was removed meanwhile
            return
        try:
            if name in self._held.names():
                drag.hold(name)
            if feedback.event_type == _Drag.POSE_UPDATE:
                parameters = self._simulation.parameters
                lowest = -parameters.position_limit  # drag.put keeps objects above the floor
                pose = read_pose(feedback.header.frame_id, feedback.pose, parameters, lowest)
                drag.put(name, frames.multiply(pose.matrix, shown.tilt))
        except ValueError as refused:
            if self._warnings.passes():
                rospy.logwarn(f"'{name}' cannot be dragged there: {refused}")
            self._server.setPose(name, message_conversion.pose(shown.level))


def _invisible_copy(item: SceneObject, visuals: Sequence[tuple[Visual, Matrix]], handle: Matrix) -> list[Marker]:
    """Return markers that the mouse can pick: an invisible, slightly larger copy of an object's shape, if it has one.

    `visuals` are the object's, with their poses; the markers are in the frame of the handle, whose pose is `handle`.
    """
    markers = []
    for visual, matrix in visuals:
        local = frames.relative(handle, matrix)
        markers += [marker_of(primitive, local, _INVISIBLE) for primitive in visual.shape.for_rviz()]
    if isinstance(item, Dummy):
        markers += bodiless_markers([item])
        markers[-1].pose = message_conversion.pose(frames.IDENTITY)
    for marker in markers:
        for axis in "xyz":
            setattr(marker.scale, axis, _ENLARGEMENT * getattr(marker.scale, axis))
    return markers
