"""The objects of the scene, to be dragged with the mouse in flight: `objects`, an interactive marker server.

The user drags the object itself: its handle is an invisible copy of its shape. The object that was dragged or clicked
last has arrows, too. An object stands still while it is held, and falls, or moves on, when it is released.
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
_QUIET = 5.0  # s, between two warnings
_ARROWS = 0.5, 5.0  # m, the least and the most of their reach
_UNSEEN = (0.2, 0.6, 1.0, 0.01)  # rviz picks no marker that is transparent altogether
_AROUND = 1.02  # times as large as what it stands for, so that the mouse meets it first
_Drag = InteractiveMarkerFeedback


class _ShownHandle(NamedTuple):
    """A handle: what it looks like, where it was told to be, and the object in its frame."""

    look: Hashable
    level: Matrix
    tilt: Matrix


class ObjectHandles:
    """A handle for everything in the scene that one can see; made while somebody listens."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise for the scene of `simulation`, whose thread empties `inbox`."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = HeldHandles()
        self._throttle, self._warnings = Throttle(_PERIOD), Throttle(_QUIET)
        self._topic = f"{namespace(simulation)}/objects/feedback"
        self._server = MarkerServer(f"{namespace(simulation)}/objects")
        self._shown: dict[str, _ShownHandle] = {}
        self._chosen = ""

    def update(self) -> None:
        """Let go of what nobody holds any more; let the handles follow the others."""
        drag = self._simulation.scene.drag
        if drag.held:
            for name in drag.held.keys() - self._held.names():
                drag.let_go(name)
        if self._server.watched and self._throttle.passes():
            self._follow()

    def _follow(self) -> None:
        things = self._simulation.scene.things()
        for name in self._shown.keys() - things.keys():
            del self._shown[name]
            self._server.erase(name)
        held = self._held.names()
        moved = {name: one for name, one in things.items() if name not in held or name not in self._shown}
        new = []
        for name, one in moved.items():
            now, before = self._at(one), self._shown.get(name)
            self._shown[name] = now
            if before is None or now.look != before.look:
                new.append(name)
            elif now.level != before.level:
                self._server.setPose(name, message_conversion.pose(now.level))
        if new:
            self._make(new, things)
        self._server.applyChanges()

    def _at(self, one: SceneObject) -> _ShownHandle:
        matrix = one.matrix()
        upright = level(matrix)
        tilt = frames.relative(upright, matrix)
        rough = tuple(round(value, 1) for value in tilt)  # the arrows stay upright, roughly, whatever rolls
        is_like = getattr(one, "number", -1), getattr(one, "size", 0.0)  # another body where it is of another size
        return _ShownHandle((self._simulation.scene, is_like, rough, one.name == self._chosen), upright, tilt)

    def _make(self, names: Sequence[str], things: dict[str, SceneObject]) -> None:
        looks = _ObjectLooks(self._simulation.scene)
        for name in names:
            upright = self._shown[name].level
            markers = looks.markers(name, things[name], upright)
            size = max((max(one.scale.x, one.scale.y, one.scale.z) for one in markers), default=0.0)
            reach = min(max(size, _ARROWS[0]), _ARROWS[1])
            handle = new_handle(name, markers, reach, arrows=name == self._chosen)
            handle.pose = message_conversion.pose(upright)
            self._server.insert(handle, self._on_feedback)

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.on_feedback(feedback)
        if feedback.event_type in (_Drag.MOUSE_DOWN, _Drag.POSE_UPDATE):
            done = intervention(MOVE, feedback.marker_name, self._topic, feedback)
            self._inbox.put(lambda: self._drag(feedback), done)
        elif feedback.event_type == _Drag.MOUSE_UP:
            self._chosen = feedback.marker_name

    def _drag(self, feedback: InteractiveMarkerFeedback) -> None:
        name, drag = feedback.marker_name, self._simulation.scene.drag
        shown = self._shown.get(name)
        if shown is None:  # it has gone meanwhile
            return
        try:
            if name in self._held.names():
                drag.hold(name)
            if feedback.event_type == _Drag.POSE_UPDATE:
                parameters = self._simulation.parameters
                lowest = -parameters.position_limit  # what drags knows the floor
                pose = read_pose(feedback.header.frame_id, feedback.pose, parameters, lowest)
                drag.put(name, frames.multiply(pose.matrix, shown.tilt))
        except ValueError as refused:
            if self._warnings.passes():
                rospy.logwarn(f"'{name}' cannot be dragged there: {refused}")
            self._server.setPose(name, message_conversion.pose(shown.level))


class _ObjectLooks:
    """Invisible, slightly larger copies of the shapes of a scene's objects, for the mouse to grab."""

    def __init__(self, scene: Scene):
        """Collect what is visible in the scene now."""
        self._found: dict[str, list[tuple[Visual, Matrix]]] = {}
        for name, visual, pose in zip(scene.visual_names(), *scene.visuals()):
            self._found.setdefault(name, []).append((visual, tuple(pose[:3].ravel().tolist())))

    def markers(self, name: str, one: SceneObject, handle: Matrix) -> list[Marker]:
        """Return the markers of an object in the frame of its handle, world from it; none for what has no shape."""
        made = []
        for visual, matrix in self._found.get(name, ()):
            local = frames.relative(handle, matrix)
            made += [marker_of(primitive, local, _UNSEEN) for primitive in visual.shape.for_rviz()]
        if isinstance(one, Dummy):
            made += bodiless_markers([one])
            made[-1].pose = message_conversion.pose(frames.IDENTITY)
        for marker in made:
            for axis in "xyz":
                setattr(marker.scale, axis, _AROUND * getattr(marker.scale, axis))
        return made
