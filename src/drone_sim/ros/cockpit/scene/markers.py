"""Conversion of the tf frames and MarkerArrays that the simulation publishes for rviz, for the browsers."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.ros.cockpit.scene.scene_state import AT_REST, ArrayName, Entry, Key, Pose, Properties
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw

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
_MIN_POINTS = {"strip": 2, "lines": 2, "cubes": 1, "spheres": 1, "points": 1, "triangles": 3}
_SIZE_DECIMALS, _COLOR_DECIMALS = 3, 3  # finer differences (m; 0..1) are not visible


class FrameTree:
    """Latest parent and pose of each tf frame, in which markers have their poses. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: dict[str, tuple[str, Pose]] = {}  # parent and pose, by name
        self._changed: set[str] = set()
        self.has_news = threading.Event()  # set by each message

    def on_transforms(self, message: Any) -> None:
        """Store the transforms of a tfMessage."""
        with self._lock:
            for transform in message.transforms:
                pose = (*xyz(transform.transform.translation), *xyzw(transform.transform.rotation))
                self._frames[transform.child_frame_id] = transform.header.frame_id, pose
                self._changed.add(transform.child_frame_id)
        self.has_news.set()

    def take(self) -> dict[str, tuple[str, Pose]]:
        """Return parent ('' for the world) and pose of the frames that have changed since the last call, parents first.

        A frame without a path to the world is returned once it has one.
        """
        with self._lock:
            depths = {frame: self._depth(frame) for frame in self._changed}
            ready = sorted((frame for frame in self._changed if depths[frame]), key=lambda frame: depths[frame])
            self._changed -= set(ready)
            changed = {frame: self._frames[frame] for frame in ready}
            return {frame: ("" if parent == WORLD_FRAME else parent, pose) for frame, (parent, pose) in changed.items()}

    def _depth(self, frame: str) -> int:
        """Return the number of frames on the path from the world to `frame`; 0 if there is no path."""
        for depth in range(len(self._frames) + 1):
            if frame == WORLD_FRAME:
                return depth
            frame = self._frames.get(frame, ("",))[0]
        return 0


class MarkerListener:
    """The markers of one topic. Thread-safe."""

    def __init__(
        self,
        layer: str,
        mesh_url: Callable[[str], str | None] = lambda _resource: None,
        *,
        hidden: Collection[str] = (),
        is_shaded: bool = False,
    ):
        """`mesh_url` returns the URL of a mesh for browsers, None for an unreadable mesh.

        Markers in the namespaces `hidden` are ignored. If `is_shaded`, markers with colors for each point, which have
        rviz's light in them, are sent without these: the browser has a sun of its own.
        """
        self.layer = layer
        self._mesh_url = mesh_url
        self._hidden, self._is_shaded = hidden, is_shaded
        self._lock = threading.Lock()
        self._keys: set[Key] = set()  # of the present markers
        self._changed: dict[Key, Entry | None] = {}

    def on_markers(self, message: MarkerArray) -> None:
        numbers: dict[str, int] | None = None
        fresh: dict[Key, Entry | None] = {}
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                # All markers follow again, maybe with other ids. The n-th of a namespace replaces the n-th before.
                numbers, fresh = {}, dict.fromkeys(self._keys)
                continue
            number = marker.id if numbers is None else numbers.get(marker.ns, 0)
            if numbers is not None:
                numbers[marker.ns] = number + 1
            key: Key = (self.layer, marker.ns, str(number))
            is_gone = marker.action == Marker.DELETE or marker.ns in self._hidden
            fresh[key] = None if is_gone else entry_of(marker, self.layer, self._mesh_url, self._is_shaded)
        with self._lock:
            self._keys = (self._keys | fresh.keys()) - {key for key, entry in fresh.items() if entry is None}
            self._changed.update(fresh)

    def take(self) -> dict[Key, Entry | None]:
        """Return the markers that have changed since the last call; None for a marker that is gone."""
        with self._lock:
            changed, self._changed = self._changed, {}
        return changed


def entry_of(
    marker: Marker, layer: str, mesh_url: Callable[[str], str | None], is_shaded: bool = False
) -> Entry | None:
    """Return a marker for the browsers; None if it is not visible."""
    kind = KINDS.get(marker.type, "")
    points = np.array([xyz(point) for point in marker.points], dtype=np.float32)
    if not kind or len(points) < _MIN_POINTS.get(kind, 0):
        return None
    color = marker.color
    properties: Properties = {
        "kind": kind,
        "layer": layer,
        "ns": marker.ns,
        "frame": marker.header.frame_id,
        "color": [round(value, _COLOR_DECIMALS) for value in (color.r, color.g, color.b, color.a)],
        "scale": [round(value, _SIZE_DECIMALS) for value in xyz(marker.scale)],
    }
    if kind == "text":
        properties["text"] = marker.text
    if kind == "mesh":
        mesh = mesh_url(marker.mesh_resource)
        if mesh is None:
            return None
        properties |= {"mesh": mesh, "own": bool(marker.mesh_use_embedded_materials)}
    arrays: dict[ArrayName, np.ndarray] = {"points": points.ravel()} if len(points) else {}
    if len(points) and len(marker.colors) == len(points) and not is_shaded:
        colors = np.array([(color.r, color.g, color.b, color.a) for color in marker.colors], dtype=np.float32)
        arrays["colors"] = np.round(colors, _COLOR_DECIMALS).ravel()
        properties["lit"] = False
    return Entry(properties, arrays, pose_of(marker.pose))


def pose_of(pose: Any) -> Pose:
    """Return a message's pose. As in rviz, the quaternion 0 0 0 0 means no rotation."""
    quaternion = xyzw(pose.orientation)
    return (*xyz(pose.position), *(quaternion if any(quaternion) else AT_REST[3:]))
