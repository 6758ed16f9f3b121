"""The objects of the scene, to be dragged with the mouse in flight: `objects`, an interactive marker server.

What is dragged is the object itself: its handle is its shape, not to be seen. The one that was dragged or clicked last
has arrows, too. An object stands still while it is held, and falls, or goes on, when it is let go.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import rospy
from visualization_msgs.msg import InteractiveMarkerFeedback

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.ros.node.inbox import Inbox
from drone_sim.ros.rviz.held import Held
from drone_sim.ros.rviz.marker_server import MarkerServer, level, new_handle, pose_message
from drone_sim.ros.rviz.marker_topic import namespace
from drone_sim.ros.rviz.object_looks import ObjectLooks
from drone_sim.ros.vehicle.inputs import checked_pose
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation

_PERIOD = 0.19  # s of real time, between two updates
_QUIET = 5.0  # s, between two warnings
_ARROWS = 0.5, 5.0  # m, the least and the most of their reach
_Drag = InteractiveMarkerFeedback


class _Shown(NamedTuple):
    """A handle: what it looks like, where it was told to be, and the object in its frame."""

    look: Hashable
    level: Matrix
    tilt: Matrix


class ObjectHandles:
    """A handle for everything in the scene that one can see; made while somebody listens."""

    def __init__(self, simulation: Simulation, inbox: Inbox):
        """Advertise."""
        self._simulation = simulation
        self._inbox = inbox
        self._held = Held()
        self._throttle, self._warnings = Throttle(_PERIOD), Throttle(_QUIET)
        self._server = MarkerServer(f"{namespace(simulation)}/objects")
        self._shown: dict[str, _Shown] = {}
        self._chosen = ""

    def update(self) -> None:
        """Let go of what nobody holds any more; let the handles follow the others."""
        grip = self._simulation.scene.grip
        if grip.held:
            for name in grip.held.keys() - self._held.names():
                grip.let_go(name)
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
                self._server.setPose(name, pose_message(now.level))
        if new:
            self._make(new, things)
        self._server.applyChanges()

    def _at(self, one: SceneObject) -> _Shown:
        matrix = one.matrix()
        upright = level(matrix)
        tilt = frames.relative(upright, matrix)
        rough = tuple(round(value, 1) for value in tilt)  # the arrows stay upright, roughly, whatever rolls
        return _Shown((self._simulation.scene, rough, one.name == self._chosen), upright, tilt)

    def _make(self, names: Sequence[str], things: dict[str, SceneObject]) -> None:
        looks = ObjectLooks(self._simulation.scene)
        for name in names:
            upright = self._shown[name].level
            markers = looks.markers(name, things[name], upright)
            size = max((max(one.scale.x, one.scale.y, one.scale.z) for one in markers), default=0.0)
            reach = min(max(size, _ARROWS[0]), _ARROWS[1])
            handle = new_handle(name, markers, reach, arrows=name == self._chosen)
            handle.pose = pose_message(upright)
            self._server.insert(handle, self._on_feedback)

    def _on_feedback(self, feedback: InteractiveMarkerFeedback) -> None:
        self._held.hear(feedback)
        if feedback.event_type in (_Drag.MOUSE_DOWN, _Drag.POSE_UPDATE):
            self._inbox.put(lambda: self._drag(feedback))
        elif feedback.event_type == _Drag.MOUSE_UP:
            self._chosen = feedback.marker_name

    def _drag(self, feedback: InteractiveMarkerFeedback) -> None:
        name, grip = feedback.marker_name, self._simulation.scene.grip
        shown = self._shown.get(name)
        if shown is None:  # it has gone meanwhile
            return
        try:
            if name in self._held.names():
                grip.hold(name)
            if feedback.event_type == _Drag.POSE_UPDATE:
                grip.put(name, frames.multiply(self._checked(feedback), shown.tilt))
        except ValueError as refused:
            if self._warnings.passes():
                rospy.logwarn(f"'{name}' cannot be dragged there: {refused}")
            self._server.setPose(name, pose_message(shown.level))

    def _checked(self, feedback: InteractiveMarkerFeedback) -> Matrix:
        """Return where a handle has been dragged. Raises ValueError for what is no pose."""
        parameters = self._simulation.parameters
        lowest = -parameters.position_limit  # the grip knows the floor
        return checked_pose(feedback.header.frame_id, feedback.pose, parameters, lowest).matrix
