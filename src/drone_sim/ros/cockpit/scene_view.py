"""The scene in the browser: everything that the simulation shows rviz, listened to while a browser is open."""

from __future__ import annotations

from typing import Any

import rospy
from geometry_msgs.msg import WrenchStamped
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)

from drone_sim.ros.cockpit.frames import Frames
from drone_sim.ros.cockpit.handles import Handles
from drone_sim.ros.cockpit.markers import Markers
from drone_sim.ros.cockpit.pushes import push

_BODIES = "view/bodies"
_TOPICS = (
    "scene",
    "drawing",
    "view/surroundings",
    _BODIES,
    "view/path",
    "view/height",
    "view/command",
    "view/forces",
    "view/state",
)


class SceneView:
    """Everything at one namespace, that of the only drone or of the node."""

    def __init__(self, scene: Any, namespace: str):
        """Listen; the node must be initialised."""
        self.namespace = namespace
        self.frames = Frames(scene)
        self.strength = 0.5  # N, of a click on a vehicle
        self._pushers: dict[str, rospy.Publisher] = {}
        self._markers = {
            name: Markers(scene, name, self.frames, self._make_pushable if name == _BODIES else lambda *_: None)
            for name in _TOPICS
        }
        feedback = rospy.Publisher(f"{namespace}/markers/feedback", InteractiveMarkerFeedback, queue_size=10)
        self.handles = Handles(scene, feedback.publish)
        heard = [
            *((f"{namespace}/{name}", MarkerArray, one.hear) for name, one in self._markers.items()),
            ("/tf", TFMessage, self.frames.hear),
            ("/tf_static", TFMessage, self.frames.hear),
            (f"{namespace}/markers/update_full", InteractiveMarkerInit, self.handles.hear_all),
            (f"{namespace}/markers/update", InteractiveMarkerUpdate, self.handles.hear),
        ]
        self._listening = [feedback, *(rospy.Subscriber(*one, queue_size=20) for one in heard)]

    def show(self) -> None:
        """Put into the scene what is new."""
        self.frames.show()
        grown, self.frames.new = self.frames.new, False
        for markers in self._markers.values():
            markers.show(frames_changed=grown)
        self.handles.show()

    def close(self) -> None:
        """Listen no more, and show nothing."""
        for one in (*self._listening, *self._pushers.values()):
            one.unregister()
        for markers in self._markers.values():
            markers.forget()
        self.handles.forget()
        self.frames.forget()

    def _make_pushable(self, marker: Marker, handle: Any) -> None:
        """Let a click on a part of a vehicle, whose name is the marker's namespace, push it."""

        @handle.on_click
        def _(event: Any) -> None:
            push(self._pusher(marker.ns).publish, event.ray_direction, self.strength)

    def _pusher(self, vehicle: str) -> rospy.Publisher:
        if vehicle not in self._pushers:
            self._pushers[vehicle] = rospy.Publisher(f"/{vehicle}/push", WrenchStamped, queue_size=1)
        return self._pushers[vehicle]
