"""Interactive markers `objects`, by which the user drags objects of the scene in flight.

The user drags the object itself, because its handle is an invisible copy of its shape. The object that was dragged or
clicked last also has arrows. An object stands still while it is held, and falls, or moves on, when it is released.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import rospy
from visualization_msgs.msg import InteractiveMarkerFeedback, Marker

from drone_sim.grading.permissions import MOVE
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.ros.core import message_conversion
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.validation import intervention, read_pose
from drone_sim.ros.rviz.marker_server import HeldHandles, MarkerServer, level, new_handle
from drone_sim.ros.rviz.marker_topics import namespace
from drone_sim.ros.rviz.scene_markers import bodiless_markers, marker_of
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.scene.scene import Scene
from drone_sim.shapes.visual import Visual

_PERIOD = 0.19  # s of real time, between two updates
_WARNING_PERIOD = 5.0  # s, between two warnings
_ARROW_SIZES = 0.5, 5.0  # m, smallest and largest
_INVISIBLE = (0.2, 0.6, 1.0, 0.01)  # rviz does not pick a marker that is entirely transparent
_ENLARGEMENT = 1.02  # of the copy, so that the mouse picks it and not the object
_Drag = InteractiveMarkerFeedback


class _ShownHandle(NamedTuple):
    """A handle in rviz: its appearance, its level pose in the world, and the object's pose in its frame."""

    look: Hashable
    level: Matrix
    tilt: Matrix


class ObjectHandles:
    """A handle for each visible object in the scene."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise for the scene of `simulation`, whose thread runs the jobs of `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle, self._warnings = Throttle(_PERIOD), Throttle(_WARNING_PERIOD)
        self._topic = f"{namespace(simulation)}/objects/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/objects")
        self._shown: dict[str, _ShownHandle] = {}
        self._selected = ""

    def update(self) -> None:
        """Release the objects that are no longer held; move the handles to the other objects."""
        drag = self._simulation.scene.drag
        if drag.held:
            for name in drag.held.keys() - self._held.names():
                drag.let_go(name)
        if self._server.has_subscribers and self._throttle.passes():
            self._update_handles()

    def _update_handles(self) -> None:
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

    def _handle_of(self, item: SceneObject) -> _ShownHandle:
        matrix = item.matrix()
        upright = level(matrix)
        tilt = frames.relative(upright, matrix)
        rough_tilt = tuple(round(value, 1) for value in tilt)  # a rolling object gets a new handle only now and then
        shape = getattr(item, "number", -1), getattr(item, "size", 0.0)  # the body's number changes with its size
        return _ShownHandle((self._simulation.scene, shape, rough_tilt, item.name == self._selected), upright, tilt)

    def _insert(self, names: Sequence[str], objects: dict[str, SceneObject]) -> None:
        copies = _InvisibleCopies(self._simulation.scene)
        for name in names:
            upright = self._shown[name].level
            markers = copies.markers(name, objects[name], upright)
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


class _InvisibleCopies:
    """Invisible, slightly larger copies of the shapes of a scene's objects, which the mouse can pick."""

    def __init__(self, scene: Scene):
        self._visuals: dict[str, list[tuple[Visual, Matrix]]] = {}
        for name, visual, pose in zip(scene.visual_names(), *scene.visuals()):
            self._visuals.setdefault(name, []).append((visual, tuple(pose[:3].ravel().tolist())))

    def markers(self, name: str, item: SceneObject, handle: Matrix) -> list[Marker]:
        """Return an object's markers in the frame of its handle, whose pose is `handle`; none without a shape."""
        markers = []
        for visual, matrix in self._visuals.get(name, ()):
            local = frames.relative(handle, matrix)
            markers += [marker_of(primitive, local, _INVISIBLE) for primitive in visual.shape.for_rviz()]
        if isinstance(item, Dummy):
            markers += bodiless_markers([item])
            markers[-1].pose = message_conversion.pose(frames.IDENTITY)
        for marker in markers:
            for axis in "xyz":
                setattr(marker.scale, axis, _ENLARGEMENT * getattr(marker.scale, axis))
        return markers
