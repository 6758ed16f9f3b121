"""What a script draws, in rviz: `<drone>/drawing`, a latched MarkerArray."""

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

_PERIOD = 0.09  # s of real time, between two looks at what was drawn
_PIXEL = 0.005  # m; rviz measures points and lines in the world
_KINDS = {
    "points": Marker.POINTS,
    "lines": Marker.LINE_LIST,
    "linestrip": Marker.LINE_STRIP,
    "spherepoints": Marker.SPHERE_LIST,
    "cubepoints": Marker.CUBE_LIST,  # level, whatever their normal is
    "triangles": Marker.TRIANGLE_LIST,
}
_CORNERS = {"trianglepoints": 3, "quadpoints": 4, "discpoints": 24}  # of what rviz has only as triangles


class DrawingMarkers:
    """Shows drawing objects, each as one marker."""

    def __init__(self, drone: str, drawings: Drawings):
        """Advertise below `drone`, where all that flies has its topics, what `drawings` hold."""
        self._drawings = drawings
        self._throttle = Throttle(_PERIOD)
        self._shown = 0
        self._publisher = rospy.Publisher(f"{drone}/drawing", MarkerArray, queue_size=1, latch=True)

    def update(self) -> None:
        """Publish what has changed, if anybody listens."""
        has_changed = self._shown != self._drawings.changes or self._drawings.carried
        if not has_changed or not self._publisher.get_num_connections():
            return
        if self._throttle.passes():
            self._shown = self._drawings.changes
            drawn = [_marker(handle, one) for handle, one in self._drawings.objects.items() if one.items]
            self._publisher.publish(MarkerArray([Marker(action=Marker.DELETEALL), *drawn]))


def _marker(handle: int, drawn: DrawingObject) -> Marker:
    kind = _KINDS.get(drawn.kind, Marker.TRIANGLE_LIST)
    scale = drawn.size * (_PIXEL if drawn.kind in ("points", "lines", "linestrip") else 1.0)
    points = [point for item in drawn.in_world() for point in _points(drawn, item)]
    scales = [1.0 if kind == Marker.TRIANGLE_LIST else scale] * 3
    marker = new_marker(kind, drawn.rgba, scales, points, ns="drawing")
    marker.header.frame_id, marker.id, marker.frame_locked = WORLD_FRAME, handle, True
    return marker


def _points(drawn: DrawingObject, item: Item) -> list[Sequence[float]]:
    if drawn.kind in _CORNERS:
        return _polygon(item, drawn.size / 2, _CORNERS[drawn.kind])
    points: list[Sequence[float]] = [item[first : first + 3] for first in range(0, len(item), 3)]
    return points[:1] if drawn.kind == "cubepoints" else points


def _polygon(item: Item, radius: float, corners: int) -> list[Sequence[float]]:
    """Return the triangles of a regular polygon about a point, across a normal."""
    middle, normal = np.array(item[:3]), _unit(np.array(item[3:]))
    aside = radius * _unit(np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0]))
    up = np.cross(normal, aside)
    angles = 2 * np.pi * np.arange(corners) / corners
    rim: Any = (middle + np.outer(np.cos(angles), aside) + np.outer(np.sin(angles), up)).tolist()
    return fan(middle.tolist(), rim)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)
