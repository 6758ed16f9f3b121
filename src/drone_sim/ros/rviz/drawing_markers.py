"""Drawing objects of scripts as rviz markers on `<drone>/drawing`, a latched MarkerArray."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rospy
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.ros.core.message_conversion import WORLD_FRAME
from drone_sim.ros.rviz.marker_topics import fan, new_marker
from drone_sim.run.pacing import Throttle
from drone_sim.scripting.api.drawings import DrawingObject, Drawings, Item

_PERIOD = 0.09  # s of real time, between two messages
_PIXEL = 0.005  # m; in rviz the sizes of points and lines are in the world
_KINDS = {
    "points": Marker.POINTS,
    "lines": Marker.LINE_LIST,
    "linestrip": Marker.LINE_STRIP,
    "spherepoints": Marker.SPHERE_LIST,
    "cubepoints": Marker.CUBE_LIST,  # level: their normals are ignored
    "triangles": Marker.TRIANGLE_LIST,
}
_CORNERS = {"trianglepoints": 3, "quadpoints": 4, "discpoints": 24}  # of polygons, which rviz draws as triangles


class DrawingMarkers:
    """Publisher of drawing objects, each as one marker."""

    def __init__(self, drone: str, drawings: Drawings):
        """Advertise `drawing` in the namespace `drone`."""
        self._drawings = drawings
        self._throttle = Throttle(_PERIOD)
        self._published = 0  # version of the drawings
        self._publisher = rospy.Publisher(f"{drone}/drawing", MarkerArray, queue_size=1, latch=True)

    def update(self) -> None:
        has_changed = self._published != self._drawings.changes or self._drawings.carried
        if not has_changed or not self._publisher.get_num_connections():
            return
        if self._throttle.passes():
            self._published = self._drawings.changes
            markers = [_marker(handle, drawing) for handle, drawing in self._drawings.objects.items() if drawing.items]
            self._publisher.publish(MarkerArray([Marker(action=Marker.DELETEALL), *markers]))


def _marker(handle: int, drawing: DrawingObject) -> Marker:
    kind = _KINDS.get(drawing.kind, Marker.TRIANGLE_LIST)
    scale = drawing.size * (_PIXEL if drawing.kind in ("points", "lines", "linestrip") else 1.0)
    points = [point for item in drawing.in_world() for point in _points(drawing, item)]
    scales = [1.0 if kind == Marker.TRIANGLE_LIST else scale] * 3
    marker = new_marker(kind, drawing.rgba, scales, points, ns="drawing")
    marker.header.frame_id, marker.id, marker.frame_locked = WORLD_FRAME, handle, True
    return marker


def _points(drawing: DrawingObject, item: Item) -> list[Sequence[float]]:
    if drawing.kind in _CORNERS:
        return _polygon(item, drawing.size / 2, _CORNERS[drawing.kind])
    points: list[Sequence[float]] = [item[first : first + 3] for first in range(0, len(item), 3)]
    return points[:1] if drawing.kind == "cubepoints" else points


def _polygon(item: Item, radius: float, corners: int) -> list[Sequence[float]]:
    """Return the triangles of a regular polygon; `item` has its center and its normal."""
    center, normal = np.array(item[:3]), _unit(np.array(item[3:]))
    side = radius * _unit(np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0]))
    up = np.cross(normal, side)
    angles = 2 * np.pi * np.arange(corners) / corners
    rim: Any = (center + np.outer(np.cos(angles), side) + np.outer(np.sin(angles), up)).tolist()
    return fan(center.tolist(), rim)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)
