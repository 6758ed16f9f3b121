"""Subscriptions to the simulation's topics for rviz, which the browsers show, while a browser is open."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
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
    MarkerArray,
)

from drone_sim.message_text import near_names, shown
from drone_sim.ros.cockpit.scene.handles import DragControls, read_drag
from drone_sim.ros.cockpit.scene.markers import FrameTree, MarkerListener
from drone_sim.ros.cockpit.scene.meshes import MeshStore
from drone_sim.ros.cockpit.scene.scene_state import SceneState
from drone_sim.ros.core.message_conversion import WORLD_FRAME

_SCENE, _BODIES, _SURROUNDINGS = "scene", "view/bodies", "view/surroundings"
_OTHER_TOPICS = ("drawing", "view/path", "view/height", "view/command", "view/forces", "view/state")
_SERVERS = ("markers", "objects")
_MAX_PUSH = 100.0  # N


class SceneView:
    """The topics in one namespace, which is that of the only drone, or the node's."""

    def __init__(self, state: SceneState, meshes: MeshStore, namespace: str):
        """Subscribe in `namespace`; frames and markers go into `state`, mesh files into `meshes`."""
        self.namespace = namespace
        self._state = state
        self._pushers: dict[str, rospy.Publisher] = {}
        self._frames = FrameTree()
        self._markers = {
            _SCENE: MarkerListener(_SCENE, meshes.url, is_shaded=True),
            _BODIES: MarkerListener(_BODIES, meshes.url, is_shaded=True),
            _SURROUNDINGS: MarkerListener(_SURROUNDINGS, meshes.url, hidden=("sky", "ground")),
            **{name: MarkerListener(name, meshes.url) for name in _OTHER_TOPICS},
        }
        self._feedback = {
            name: rospy.Publisher(f"{namespace}/{name}/feedback", InteractiveMarkerFeedback, queue_size=10)
            for name in _SERVERS
        }
        self._handles = {name: DragControls(name, publisher.publish) for name, publisher in self._feedback.items()}
        subscriptions: list[tuple[str, Any, Callable[[Any], None]]] = [
            *((f"{namespace}/{name}", MarkerArray, topic.on_markers) for name, topic in self._markers.items()),
            ("/tf", TFMessage, self._frames.on_transforms),
            ("/tf_static", TFMessage, self._frames.on_transforms),
        ]
        for name, handles in self._handles.items():
            subscriptions.append((f"{namespace}/{name}/update_full", InteractiveMarkerInit, handles.on_init))
            subscriptions.append((f"{namespace}/{name}/update", InteractiveMarkerUpdate, handles.on_update))
        self._subscribers = [rospy.Subscriber(*subscription, queue_size=20) for subscription in subscriptions]

    def wait(self, seconds: float) -> None:
        """Wait until a frame has moved, for at most `seconds`."""
        self._frames.has_news.wait(seconds)
        self._frames.has_news.clear()

    def keep(self, browsers: Collection[int]) -> None:
        """Keep held handles alive in the simulation; release those of browsers that are not in `browsers`."""
        for handles in self._handles.values():
            handles.keep(browsers)

    def collect(self) -> None:
        """Put changed frames and markers into the state."""
        markers = {}
        # A handle is shown once the simulation has subscribed to its feedback: earlier feedback would be lost.
        ready = [self._handles[name] for name, publisher in self._feedback.items() if publisher.get_num_connections()]
        sources: list[MarkerListener | DragControls] = [*self._markers.values(), *ready]
        for source in sources:
            markers.update(source.take())
        self._state.change(self._frames.take(), markers)

    def drag(self, browser: int, message: Mapping[str, Any]) -> None:
        """Process a browser's message about a handle. Raises ValueError."""
        drag = read_drag(message)
        if drag.server not in self._handles:
            raise ValueError(f"server = {shown(drag.server)}: must be one of {', '.join(_SERVERS)}")
        self._handles[drag.server].drag(browser, drag)

    def push(self, message: Mapping[str, Any]) -> None:
        """Push a vehicle along `ray` (world) with `newtons`, as a browser's message says. Raises ValueError."""
        vehicle, ray, newtons = read_push(message)
        if vehicle not in self._pushers:
            raise ValueError(f"push = {shown(vehicle)}: {near_names(vehicle, self._pushers)}")
        direction = np.asarray(ray, dtype=float)
        force = Vector3(*(direction / np.linalg.norm(direction) * newtons))
        self._pushers[vehicle].publish(WrenchStamped(Header(frame_id=WORLD_FRAME), Wrench(force=force)))

    def meet(self, vehicles: Collection[str]) -> None:
        """Advertise pushes to these vehicles early, because the first message of a new publisher may be lost."""
        for vehicle in vehicles:
            if vehicle not in self._pushers:
                self._pushers[vehicle] = rospy.Publisher(f"/{vehicle}/push", WrenchStamped, queue_size=1)

    def close(self) -> None:
        """Unsubscribe from all topics, and clear the state."""
        for endpoint in (*self._feedback.values(), *self._subscribers, *self._pushers.values()):
            endpoint.unregister()
        self._state.clear()


def read_push(message: Mapping[str, Any]) -> tuple[str, Sequence[float], float]:
    """Return vehicle, direction (world) and force (N) of a browser's message. Raises ValueError."""
    vehicle, ray = message.get("push"), message.get("ray")
    newtons: Any = message.get("newtons")
    if not isinstance(vehicle, str):
        raise ValueError(f"push = {shown(vehicle)}: must be the name of a vehicle")
    if not isinstance(ray, list) or len(ray) != 3 or not all(map(_is_number, ray)) or not any(ray):
        raise ValueError("ray: must be x, y and z of a direction")
    if not _is_number(newtons) or not 0 < newtons <= _MAX_PUSH:
        raise ValueError(f"newtons = {shown(newtons)}: must be a number above 0, {_MAX_PUSH:g} at most")
    return vehicle, ray, float(newtons)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
