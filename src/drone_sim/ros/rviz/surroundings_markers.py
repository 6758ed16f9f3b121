"""Markers of floor, ground and sky, as the cameras show them, on `<drone>/view/surroundings`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.render import sky
from drone_sim.ros.rviz.marker_topics import TEXT_PERIOD, MarkerTopic, band, namespace, new_marker
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.run.simulation import Simulation
from drone_sim.scene.scene import Scene
from drone_sim.shapes.visual import Visual

_SKY = 5000.0  # m, radius
_GROUND_HEIGHT = -0.06  # m; the floor is higher
_SECTORS = 48
# Color of the ground by distance (m) from the floor: darker than the floor; far away, as the sky at the horizon.
_GROUND = (
    (0.0, (0.40, 0.43, 0.39)),
    (12.0, (0.45, 0.48, 0.45)),
    (40.0, (0.58, 0.60, 0.59)),
    (120.0, (0.70, 0.72, 0.735)),
    (600.0, (0.762, 0.79, 0.813)),
)
_GREY = (0.6, 0.6, 0.6, 1.0)


class SurroundingsMarkers:
    """Publisher of floor, ground and sky, when the scene or its floor is replaced."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise for the scene of `simulation`; its floor is written to `files`."""
        self._simulation = simulation
        self._files = files
        self._published: tuple[Scene, int] | None = None  # scene, and the number of its floor's body
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/surroundings", TEXT_PERIOD)

    def update(self) -> None:
        """Publish the surroundings if they have changed and there are subscribers."""
        self._topic.repeat()
        scene = self._simulation.scene
        if self._published == (scene, scene.floor) or not self._topic.is_due():
            return
        self._published = scene, scene.floor
        dome: Any = sky.dome().reshape(-1, 6).tolist()
        markers = [_colored_triangles("sky", _SKY, dome), _ground(self._simulation.parameters.scene.floor.size / 2)]
        markers += [self._floor(visual) for visual in self._simulation.world.pictures.visuals() if visual.floor]
        self._topic.show(markers)

    def _floor(self, visual: Visual) -> Marker:
        marker = new_marker(Marker.MESH_RESOURCE, (0, 0, 0, 0), (1, 1, 1), ns="floor")
        try:
            marker.mesh_resource, marker.mesh_use_embedded_materials = self._files.resource(visual, glow=1.0), True
        except (ValueError, OSError) as error:
            rospy.logwarn(f"rviz shows the floor without its texture: {error}")
            size = self._simulation.parameters.scene.floor.size
            marker.type, marker.color, marker.scale = Marker.CUBE, ColorRGBA(*_GREY), Vector3(size, size, 1e-3)
        return marker


def _ground(half: float) -> Marker:
    """Return a disc with the colors of _GROUND; `half` is half of the floor's side, m."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SECTORS + 1)
    rings = [[(0.0, 0.0, _GROUND_HEIGHT, *_GROUND[0][1])] * len(angles)]
    for distance, color in _GROUND:
        radius = half + distance
        rings.append([(radius * np.cos(a), radius * np.sin(a), _GROUND_HEIGHT, *color) for a in angles])
    corners = [corner for inner, outer in itertools.pairwise(rings) for corner in band(inner, outer)]
    return _colored_triangles("ground", 1.0, corners)


def _colored_triangles(name: str, scale: float, corners: Sequence[Sequence[float]]) -> Marker:
    """Return a marker of triangles; each corner is x, y, z, red, green, blue."""
    points = [corner[:3] for corner in corners]
    marker = new_marker(Marker.TRIANGLE_LIST, (1, 1, 1, 1), [scale] * 3, points, ns=name)
    marker.colors = [ColorRGBA(*corner[3:], 1.0) for corner in corners]
    return marker
