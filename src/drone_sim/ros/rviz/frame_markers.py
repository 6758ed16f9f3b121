"""What of a scene has no body, in rviz: dummies as small balls, paths as lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.ros.rviz.marker_topic import new_marker
from drone_sim.scene.kinds.dummy import Dummy

_DUMMY = (0.9, 0.9, 0.95, 0.8)
_PATH = (0.2, 0.5, 0.9, 0.8)
_WIDTH = 0.01  # m, of a line
_MOST = 2000  # points of a line


def markers_of(objects: Iterable[SceneObject]) -> Iterator[Marker]:
    """Yield a marker for each dummy and each path among some objects, in the frame `world`."""
    for one in objects:
        if isinstance(one, (Dummy, Path)):
            marker = _ball(one) if isinstance(one, Dummy) else _line(one)
            marker.ns = one.name
            yield marker


def _ball(dummy: Dummy) -> Marker:
    marker = new_marker(Marker.SPHERE, _DUMMY, [dummy.size] * 3)
    marker.pose.position = Point(*frames.position(dummy.matrix()))
    return marker


def _line(path: Path) -> Marker:
    every = -(-len(path.points) // _MOST)
    points = [*path.points[:-1:every], path.points[-1]]
    matrix = path.matrix()
    return new_marker(Marker.LINE_STRIP, _PATH, (_WIDTH, 0, 0), [frames.transform(matrix, one) for one in points])
