"""Things to drag in the browser: the handles that the simulation offers to rviz, as viser's transform controls."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
)

from drone_sim.ros.cockpit.frames import ROOT

_SCALE = 0.25  # m


class Handles:
    """One control for each interactive marker. Messages are taken in any thread; `show` is called in one."""

    def __init__(self, scene: Any, publish: Callable[[InteractiveMarkerFeedback], None]):
        """Take what hears about drags: the topic `markers/feedback`."""
        self._scene = scene
        self._publish = publish
        self._lock = threading.Lock()
        self._wanted: dict[str, Pose] = {}
        self._shown: dict[str, Any] = {}
        self._held: set[str] = set()
        self._visible = True

    def hear_all(self, message: InteractiveMarkerInit) -> None:
        """Take all that there are."""
        with self._lock:
            self._wanted = {one.name: one.pose for one in message.markers}

    def hear(self, message: InteractiveMarkerUpdate) -> None:
        """Take what has come, gone or moved."""
        with self._lock:
            for one in (*message.markers, *message.poses):
                if one in message.markers or one.name in self._wanted:
                    self._wanted[one.name] = one.pose
            for name in message.erases:
                self._wanted.pop(name, None)

    def show(self) -> None:
        """Put the handles where they are, but for those that somebody drags."""
        with self._lock:
            wanted = dict(self._wanted)
        for name in self._shown.keys() - wanted.keys():
            self._shown.pop(name).remove()
        for name, pose in wanted.items():
            control = self._shown.get(name) or self._make(name)
            place = (pose.position.x, pose.position.y, pose.position.z)
            if name not in self._held and tuple(control.position) != place:
                control.position = place

    def forget(self) -> None:
        """Have none."""
        with self._lock:
            self._wanted = {}
        self._held.clear()
        self.show()

    def show_all(self, visible: bool) -> None:
        """Let the handles be seen, or not."""
        if visible == self._visible:
            return
        self._visible = visible
        for control in self._shown.values():
            control.visible = visible

    def _make(self, name: str) -> Any:
        control = self._scene.add_transform_controls(
            f"/handles/{name.replace('/', '_')}", scale=_SCALE, disable_rotations=True, visible=self._visible
        )
        self._shown[name] = control
        control.on_drag_start(lambda event: self._on_drag(name, event, InteractiveMarkerFeedback.MOUSE_DOWN))
        control.on_update(lambda event: self._on_drag(name, event, InteractiveMarkerFeedback.POSE_UPDATE))
        control.on_drag_end(lambda event: self._on_drag(name, event, InteractiveMarkerFeedback.MOUSE_UP))
        return control

    def _on_drag(self, name: str, event: Any, kind: int) -> None:
        if kind == InteractiveMarkerFeedback.MOUSE_UP:
            self._held.discard(name)
        else:
            self._held.add(name)
        with self._lock:
            known = self._wanted.get(name)
        if known is None:
            return
        feedback = InteractiveMarkerFeedback(client_id=f"cockpit/{event.client_id}", marker_name=name, event_type=kind)
        feedback.header.frame_id = ROOT
        turn = known.orientation
        feedback.pose = Pose(Point(*map(float, event.target.position)), Quaternion(turn.x, turn.y, turn.z, turn.w))
        self._publish(feedback)
