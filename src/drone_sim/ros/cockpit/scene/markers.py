"""MarkerArrays, which the simulation makes for rviz, as what the browsers show.

What is said of a marker: `kind`; `layer`, the topic's name; `ns`; `color` r g b a (0..1, as on a screen); `scale`, m;
and where it has them `text`, `mesh` (an address), `own` (the mesh has its own colours) and `lit` (false: it is as
bright from everywhere). Its arrays: `points` (x y z each, m), `colors` (r g b a each).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.ros.cockpit.scene.scene_state import AT_REST, Entry, Key, Pose
from drone_sim.ros.core.message_conversion import xyz

KINDS = {
    Marker.ARROW: "arrow",
    Marker.CUBE: "cube",
    Marker.SPHERE: "sphere",
    Marker.CYLINDER: "cylinder",
    Marker.LINE_STRIP: "strip",
    Marker.LINE_LIST: "lines",
    Marker.CUBE_LIST: "cubes",
    Marker.SPHERE_LIST: "spheres",
    Marker.POINTS: "points",
    Marker.TEXT_VIEW_FACING: "text",
    Marker.MESH_RESOURCE: "mesh",
    Marker.TRIANGLE_LIST: "triangles",
}
_LEAST = {"strip": 2, "lines": 2, "cubes": 1, "spheres": 1, "points": 1, "triangles": 3}  # points, to be seen
_DIGITS, _SHADES = 3, 3  # of a size in m, of a colour: who could tell more apart


class MarkerTopic:
    """The markers of one topic; any thread may call."""

    def __init__(
        self,
        layer: str,
        mesh_url: Callable[[str], str | None] = lambda _resource: None,
        *,
        hidden: Collection[str] = (),
        is_shaded: bool = False,
    ):
        """Begin with none; `mesh_url` returns where a browser gets a mesh, None where it cannot be read.

        `hidden` are namespaces that the browser has in another way. With `is_shaded` the light that is painted on for
        rviz is left out: the browser has a sun.
        """
        self.layer = layer
        self._mesh_url = mesh_url
        self._hidden, self._is_shaded = hidden, is_shaded
        self._lock = threading.Lock()
        self._there: dict[Key, Entry] = {}
        self._changed: dict[Key, Entry | None] = {}

    def on_markers(self, message: MarkerArray) -> None:
        """Take a message."""
        numbers: dict[str, int] | None = None
        fresh: dict[Key, Entry | None] = {}
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                # All is told anew: the n-th of its namespace is the one that was the n-th, whatever its id is now.
                numbers, fresh = {}, dict.fromkeys(self._there)
                continue
            number = marker.id if numbers is None else numbers.get(marker.ns, 0)
            if numbers is not None:
                numbers[marker.ns] = number + 1
            key = (self.layer, marker.ns, str(number))
            fresh[key] = None if marker.action == Marker.DELETE else self._entry(marker)
        self._put(fresh)

    def take(self) -> dict[Key, Entry | None]:
        """Return what has changed since the last call, None for what is gone."""
        with self._lock:
            changed, self._changed = self._changed, {}
        return changed

    def _put(self, fresh: dict[Key, Entry | None]) -> None:
        with self._lock:
            for key, entry in fresh.items():
                if entry is None:
                    self._there.pop(key, None)
                else:
                    self._there[key] = entry
            self._changed.update(fresh)

    def _entry(self, marker: Marker) -> Entry | None:
        return None if marker.ns in self._hidden else entry_of(marker, self.layer, self._mesh_url, self._is_shaded)


def entry_of(
    marker: Marker, layer: str, mesh_url: Callable[[str], str | None], is_shaded: bool = False
) -> Entry | None:
    """Return what a browser is told of a marker, None where there is nothing to see."""
    kind = KINDS.get(marker.type, "")
    points = np.array([(one.x, one.y, one.z) for one in marker.points], dtype=np.float32)
    if not kind or len(points) < _LEAST.get(kind, 0):
        return None
    color = marker.color
    said: dict[str, Any] = {
        "kind": kind,
        "layer": layer,
        "ns": marker.ns,
        "frame": marker.header.frame_id,
        "color": [round(one, _SHADES) for one in (color.r, color.g, color.b, color.a)],
        "scale": [round(one, _DIGITS) for one in xyz(marker.scale)],
    }
    if kind == "text":
        said["text"] = marker.text
    if kind == "mesh":
        said["mesh"], said["own"] = mesh_url(marker.mesh_resource), bool(marker.mesh_use_embedded_materials)
        if said["mesh"] is None:
            return None
    arrays = {"points": points.ravel()} if len(points) else {}
    if len(points) and len(marker.colors) == len(points) and not is_shaded:
        shades = np.array([(one.r, one.g, one.b, one.a) for one in marker.colors], dtype=np.float32)
        arrays["colors"] = np.round(shades, _SHADES).ravel()
        said["lit"] = False
    return Entry(said, arrays, pose_of(marker.pose))


def pose_of(pose: Any) -> Pose:
    """Return a message's pose; one without an orientation is upright, as in rviz."""
    turn = pose.orientation
    quaternion = (turn.x, turn.y, turn.z, turn.w)
    return (*xyz(pose.position), *(quaternion if any(quaternion) else AT_REST[3:]))
