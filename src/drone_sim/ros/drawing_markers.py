"""What a script draws, in rviz: `<drone>/drawing`, a latched MarkerArray."""

from __future__ import annotations

import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.ros.messages import WORLD
from drone_sim.scripting.drawings import DrawingObject, Drawings

_EVERY = 2  # steps between two looks at what was drawn
_PIXEL = 0.005  # m; rviz measures points and lines in the world
_FLAT = 0.001  # m
_KINDS = {
    "points": Marker.POINTS,
    "lines": Marker.LINE_LIST,
    "triangles": Marker.TRIANGLE_LIST,
    "trianglepoints": Marker.CUBE_LIST,
    "quadpoints": Marker.CUBE_LIST,
    "discpoints": Marker.SPHERE_LIST,
    "cubepoints": Marker.CUBE_LIST,
    "spherepoints": Marker.SPHERE_LIST,
    "linestrip": Marker.LINE_STRIP,
}
_LEVEL = ("trianglepoints", "quadpoints", "discpoints")  # drawn flat, as if their normal were up


class DrawingMarkers:
    """Shows drawing objects, each as one marker."""

    def __init__(self, drone: str, drawings: Drawings):
        """Advertise in the drone's namespace."""
        self._drawings = drawings
        self._steps = 0
        self._shown = 0
        self._publisher = rospy.Publisher(f"{drone}/drawing", MarkerArray, queue_size=1, latch=True)

    def update(self) -> None:
        """Publish what has changed, if anybody listens."""
        self._steps += 1
        if self._shown == self._drawings.changes or self._steps % _EVERY:
            return
        if self._publisher.get_num_connections():
            self._shown = self._drawings.changes
            drawn = [_marker(handle, one) for handle, one in self._drawings.objects.items() if one.items]
            self._publisher.publish(MarkerArray([Marker(action=Marker.DELETEALL), *drawn]))


def _marker(handle: int, drawn: DrawingObject) -> Marker:
    marker = Marker(type=_KINDS[drawn.kind], ns="drawing", id=handle, frame_locked=True)
    marker.header.frame_id = WORLD
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(*drawn.rgba)
    size = drawn.size
    if drawn.kind in ("points", "lines", "linestrip"):
        size *= _PIXEL
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0 if drawn.kind == "triangles" else size
    if drawn.kind in _LEVEL:
        marker.scale.z = _FLAT
    for item in drawn.items:
        marker.points += [Point(*item[first : first + 3]) for first in range(0, len(item), 3)]
    return marker
