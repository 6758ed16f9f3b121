"""The scene in the browser: everything that the simulation shows rviz, listened to while a browser is open."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)

from drone_sim.render.renderer import TO_SUN
from drone_sim.ros.cockpit.scene.frames import FrameTree
from drone_sim.ros.cockpit.scene.handles import ANYWHERE, DragControls, Selection
from drone_sim.ros.cockpit.scene.markers import MarkerNodes
from drone_sim.ros.core.message_conversion import WORLD_FRAME

_SCENE, _BODIES, _AROUND = "scene", "view/bodies", "view/surroundings"
_OTHERS = ("drawing", "view/path", "view/height", "view/command", "view/forces", "view/state")
_AWAY = 50.0  # m; only the direction counts
_BRIGHT = 2.2
_DARK = 0.45  # what a shadow takes away of the floor's brightness
_FLOOR = "floor"  # the namespace of the marker on which shadows fall


class SceneView:
    """Everything at one namespace, that of the only drone or of the node."""

    def __init__(self, scene: Any, namespace: str, sun: Sunlight, selection: Selection):
        """Listen at `namespace`; show it in `scene`, lit by `sun`. A click on an object changes `selection`."""
        self.namespace = namespace
        self.frames = FrameTree(scene)
        self.strength = 0.5  # N, of a click on a vehicle
        self._selection, self._sun = selection, sun
        self._pushers: dict[str, rospy.Publisher] = {}
        self._markers = {
            _SCENE: MarkerNodes(scene, _SCENE, self.frames, self._make_choosable, casts=True),
            _BODIES: MarkerNodes(scene, _BODIES, self.frames, self._make_pushable, casts=True),
            _AROUND: MarkerNodes(scene, _AROUND, self.frames, sun.shine_on, hidden=("sky",)),
            **{name: MarkerNodes(scene, name, self.frames) for name in _OTHERS},
        }
        drags = [
            rospy.Publisher(f"{namespace}/{name}/feedback", InteractiveMarkerFeedback, queue_size=10)
            for name in ("markers", "objects")
        ]
        self.handles = DragControls(scene, drags[0].publish)
        self.objects = DragControls(scene, drags[1].publish, "objects", lambda name: name == selection.name, ANYWHERE)
        heard = [
            *((f"{namespace}/{name}", MarkerArray, one.on_markers) for name, one in self._markers.items()),
            ("/tf", TFMessage, self.frames.on_transforms),
            ("/tf_static", TFMessage, self.frames.on_transforms),
            (f"{namespace}/markers/update_full", InteractiveMarkerInit, self.handles.on_init),
            (f"{namespace}/markers/update", InteractiveMarkerUpdate, self.handles.on_update),
            (f"{namespace}/objects/update_full", InteractiveMarkerInit, self.objects.on_init),
            (f"{namespace}/objects/update", InteractiveMarkerUpdate, self.objects.on_update),
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
        for one in (self.handles, self.objects, self._sun, self.frames):
            one.forget()

    def _make_choosable(self, marker: Marker, handle: Any) -> None:
        """Let a click on an object, whose name is the marker's namespace, choose it."""
        if hasattr(handle, "on_click"):  # lines have none
            handle.on_click(lambda _: self._selection.toggle(marker.ns))

    def _make_pushable(self, marker: Marker, handle: Any) -> None:
        """Let a click on a part of a vehicle, whose name is the marker's namespace, push it."""
        vehicle = marker.ns
        if vehicle not in self._pushers:  # now: the first message of a new publisher is heard by nobody
            self._pushers[vehicle] = rospy.Publisher(f"/{vehicle}/push", WrenchStamped, queue_size=1)

        @handle.on_click
        def _(event: Any) -> None:
            push(self._pushers[vehicle].publish, event.ray_direction, self.strength)


class Sunlight:
    """The sun of one scene; without a GPU its shadows make every picture take twice as long or more."""

    def __init__(self, scene: Any):
        """Shine on `scene`, with shadows."""
        self._on = True
        self._floors: dict[str, Any] = {}
        scene.configure_default_lights(enabled=False)
        place = tuple(map(float, _AWAY * np.array(TO_SUN)))
        self._sun = scene.add_light_directional("/sun", intensity=_BRIGHT, cast_shadow=True, position=place)

    def shine_on(self, marker: Marker, handle: Any) -> None:
        """Let shadows fall on what has come into the scene, if it is a floor."""
        if marker.ns == _FLOOR:
            self._floors[handle.name] = handle
            handle.receive_shadow = self._darkness

    def cast(self, shadows: bool) -> None:
        """Let there be shadows, or not."""
        if shadows == self._on:
            return
        self._on = self._sun.cast_shadow = shadows
        for handle in self._floors.values():
            handle.receive_shadow = self._darkness

    def forget(self) -> None:
        """Have no floor."""
        self._floors.clear()

    @property
    def _darkness(self) -> float | bool:
        return _DARK if self._on else False


def push(publish: Callable[[WrenchStamped], None], direction: Sequence[float], strength: float) -> None:
    """Push with so many N in a direction of the world."""
    along = np.asarray(direction, dtype=float)
    force = Vector3(*(along / np.linalg.norm(along) * strength))
    publish(WrenchStamped(Header(frame_id=WORLD_FRAME), Wrench(force=force)))
