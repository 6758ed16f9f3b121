"""The scene in the browser: everything that the simulation shows rviz, listened to while a browser is open."""

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
from drone_sim.ros.cockpit.scene.frames import FrameTree
from drone_sim.ros.cockpit.scene.handles import DragControls, read_drag
from drone_sim.ros.cockpit.scene.markers import MarkerTopic
from drone_sim.ros.cockpit.scene.meshes import MeshStore
from drone_sim.ros.cockpit.scene.scene_state import SceneState
from drone_sim.ros.core.message_conversion import WORLD_FRAME

_SCENE, _BODIES, _AROUND = "scene", "view/bodies", "view/surroundings"
_OTHERS = ("drawing", "view/path", "view/height", "view/command", "view/forces", "view/state")
_SERVERS = ("markers", "objects")
_STRONGEST = 100.0  # N, of a push


class SceneView:
    """Everything at one namespace, that of the only drone or of the node."""

    def __init__(self, state: SceneState, meshes: MeshStore, namespace: str):
        """Listen at `namespace`; put what is heard into `state`, and mesh files into `meshes`."""
        self.namespace = namespace
        self._state = state
        self._pushers: dict[str, rospy.Publisher] = {}
        self._frames = FrameTree()
        self._markers = {
            _SCENE: MarkerTopic(_SCENE, meshes.url, is_shaded=True),
            _BODIES: MarkerTopic(_BODIES, meshes.url, is_shaded=True),
            _AROUND: MarkerTopic(_AROUND, meshes.url, hidden=("sky", "ground")),
            **{name: MarkerTopic(name, meshes.url) for name in _OTHERS},
        }
        self._feedback = {
            name: rospy.Publisher(f"{namespace}/{name}/feedback", InteractiveMarkerFeedback, queue_size=10)
            for name in _SERVERS
        }
        self._handles = {name: DragControls(name, one.publish) for name, one in self._feedback.items()}
        heard: list[tuple[str, Any, Callable[[Any], None]]] = [
            *((f"{namespace}/{name}", MarkerArray, one.on_markers) for name, one in self._markers.items()),
            ("/tf", TFMessage, self._frames.on_transforms),
            ("/tf_static", TFMessage, self._frames.on_transforms),
        ]
        for name, handles in self._handles.items():
            heard.append((f"{namespace}/{name}/update_full", InteractiveMarkerInit, handles.on_init))
            heard.append((f"{namespace}/{name}/update", InteractiveMarkerUpdate, handles.on_update))
        self._listening = [*self._feedback.values(), *(rospy.Subscriber(*one, queue_size=20) for one in heard)]

    def wait(self, seconds: float) -> None:
        """Wait until something has moved, or so many s."""
        self._frames.came.wait(seconds)
        self._frames.came.clear()

    def keep(self, browsers: Collection[int]) -> None:
        """Tell the simulation which handles are still held; release those of browsers that are not open any more."""
        for handles in self._handles.values():
            handles.keep(browsers)

    def collect(self) -> bool:
        """Put what is new into the state; return whether there is anything."""
        markers = {}
        # A handle is shown once the simulation would hear of it: what is said before that is lost.
        heard = [self._handles[name] for name, one in self._feedback.items() if one.get_num_connections()]
        sources: list[MarkerTopic | DragControls] = [*self._markers.values(), *heard]
        for source in sources:
            markers.update(source.take())
        return self._state.change(self._frames.take(), markers)

    def drag(self, browser: int, message: Mapping[str, Any]) -> None:
        """Take what a browser says of a handle. Raises ValueError."""
        given = read_drag(message)
        if given.server not in self._handles:
            raise ValueError(f"server = {shown(given.server)}: must be one of {', '.join(_SERVERS)}")
        self._handles[given.server].drag(browser, given)

    def push(self, message: Mapping[str, Any]) -> None:
        """Push the vehicle that a browser names, along the `ray` (world), with `newtons`. Raises ValueError."""
        vehicle, ray, newtons = read_push(message)
        if vehicle not in self._pushers:
            raise ValueError(f"push = {shown(vehicle)}: {near_names(vehicle, self._pushers)}")
        push(self._pushers[vehicle].publish, ray, newtons)

    def meet(self, vehicles: Collection[str]) -> None:
        """Advertise pushes to these vehicles early: nobody hears the first message of a new publisher."""
        for one in vehicles:
            if one not in self._pushers:
                self._pushers[one] = rospy.Publisher(f"/{one}/push", WrenchStamped, queue_size=1)

    def close(self) -> None:
        """Listen no more, and show nothing."""
        for one in (*self._listening, *self._pushers.values()):
            one.unregister()
        self._state.clear()


def read_push(message: Mapping[str, Any]) -> tuple[str, Sequence[float], float]:
    """Return vehicle, direction (world) and force (N) of a browser's message. Raises ValueError."""
    vehicle, ray = message.get("push"), message.get("ray")
    newtons: Any = message.get("newtons")
    if not isinstance(vehicle, str):
        raise ValueError(f"push = {shown(vehicle)}: must be the name of a vehicle")
    if not isinstance(ray, list) or len(ray) != 3 or not all(_is_number(one) for one in ray) or not any(ray):
        raise ValueError("ray: must be x, y and z of a direction")
    if not _is_number(newtons) or not 0 < newtons <= _STRONGEST:
        raise ValueError(f"newtons = {shown(newtons)}: must be a number above 0, {_STRONGEST:g} at most")
    return vehicle, ray, float(newtons)


def _is_number(given: Any) -> bool:
    return isinstance(given, (int, float)) and not isinstance(given, bool) and math.isfinite(given)


def push(publish: Callable[[WrenchStamped], None], direction: Sequence[float], strength: float) -> None:
    """Push with so many N in a direction of the world."""
    along = np.asarray(direction, dtype=float)
    force = Vector3(*(along / np.linalg.norm(along) * strength))
    publish(WrenchStamped(Header(frame_id=WORLD_FRAME), Wrench(force=force)))
