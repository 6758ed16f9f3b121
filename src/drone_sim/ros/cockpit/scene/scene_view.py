"""The scene in the browser: everything that the simulation shows rviz, listened to while a browser is open."""

from __future__ import annotations

from collections.abc import Collection
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

from drone_sim.ros.cockpit.scene.choice import Choice
from drone_sim.ros.cockpit.scene.frames import Frames
from drone_sim.ros.cockpit.scene.handles import ANYWHERE, Handles
from drone_sim.ros.cockpit.scene.markers import Markers
from drone_sim.ros.cockpit.scene.pushes import push
from drone_sim.ros.cockpit.scene.sunlight import Sunlight

_SCENE, _BODIES, _AROUND = "scene", "view/bodies", "view/surroundings"
_OTHERS = ("drawing", "view/path", "view/height", "view/command", "view/forces", "view/state")


class SceneView:
    """Everything at one namespace, that of the only drone or of the node."""

    def __init__(self, scene: Any, namespace: str, sun: Sunlight, choice: Choice):
        """Listen; the node must be initialised. What is clicked on is chosen."""
        self.namespace = namespace
        self.frames = Frames(scene)
        self.strength = 0.5  # N, of a click on a vehicle
        self._choice, self._sun = choice, sun
        self._pushers: dict[str, rospy.Publisher] = {}
        self._markers = {
            _SCENE: Markers(scene, _SCENE, self.frames, self._make_choosable, casts=True),
            _BODIES: Markers(scene, _BODIES, self.frames, self._make_pushable, casts=True),
            _AROUND: Markers(scene, _AROUND, self.frames, sun.shine_on, hidden=("sky",)),
            **{name: Markers(scene, name, self.frames) for name in _OTHERS},
        }
        drags = [
            rospy.Publisher(f"{namespace}/{name}/feedback", InteractiveMarkerFeedback, queue_size=10)
            for name in ("markers", "objects")
        ]
        self.handles = Handles(scene, drags[0].publish)
        self.objects = Handles(scene, drags[1].publish, "objects", lambda name: name == choice.name, ANYWHERE)
        heard = [
            *((f"{namespace}/{name}", MarkerArray, one.hear) for name, one in self._markers.items()),
            ("/tf", TFMessage, self.frames.hear),
            ("/tf_static", TFMessage, self.frames.hear),
            (f"{namespace}/markers/update_full", InteractiveMarkerInit, self.handles.hear_all),
            (f"{namespace}/markers/update", InteractiveMarkerUpdate, self.handles.hear),
            (f"{namespace}/objects/update_full", InteractiveMarkerInit, self.objects.hear_all),
            (f"{namespace}/objects/update", InteractiveMarkerUpdate, self.objects.hear),
        ]
        self._listening = [*drags, *(rospy.Subscriber(*one, queue_size=20) for one in heard)]

    def show(self, browsers: Collection[int]) -> None:
        """Put into the scene what is new, for the browsers that are open."""
        self.frames.show()
        grown, self.frames.new = self.frames.new, False
        for markers in self._markers.values():
            markers.show(frames_changed=grown)
        for handles in (self.handles, self.objects):
            handles.show(browsers)

    def close(self) -> None:
        """Listen no more, and show nothing."""
        for one in (*self._listening, *self._pushers.values()):
            one.unregister()
        for markers in self._markers.values():
            markers.forget()
        self.handles.forget()
        self.objects.forget()
        self._sun.forget()
        self.frames.forget()

    def _make_choosable(self, marker: Marker, handle: Any) -> None:
        """Let a click on an object, whose name is the marker's namespace, choose it."""
        if hasattr(handle, "on_click"):  # lines have none
            handle.on_click(lambda _: self._choice.toggle(marker.ns))

    def _make_pushable(self, marker: Marker, handle: Any) -> None:
        """Let a click on a part of a vehicle, whose name is the marker's namespace, push it."""
        pusher = self._pusher(marker.ns)  # now: the first message of a new publisher is heard by nobody

        @handle.on_click
        def _(event: Any) -> None:
            push(pusher.publish, event.ray_direction, self.strength)

    def _pusher(self, vehicle: str) -> rospy.Publisher:
        if vehicle not in self._pushers:
            self._pushers[vehicle] = rospy.Publisher(f"/{vehicle}/push", WrenchStamped, queue_size=1)
        return self._pushers[vehicle]
