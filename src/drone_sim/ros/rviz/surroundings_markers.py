"""Floor, ground and sky in rviz, as the cameras show them: `<drone>/view/surroundings`."""

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
from drone_sim.ros.rviz.marker_topics import WORDS, MarkerTopic, band, namespace, new_marker
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.run.simulation import Simulation
from drone_sim.scene.scene import Scene
from drone_sim.shapes.visual import Visual

_SKY = 5000.0  # m, its radius
_BELOW = -0.06  # m, where the ground lies: the floor stands out of it
_SECTORS = 48
# The ground, by metres beyond the floor: darker than it, and far away what the sky is at the horizon.
_GROUND = (
    (0.0, (0.40, 0.43, 0.39)),
    (12.0, (0.45, 0.48, 0.45)),
    (40.0, (0.58, 0.60, 0.59)),
    (120.0, (0.70, 0.72, 0.735)),
    (600.0, (0.762, 0.79, 0.813)),
)
_GREY = (0.6, 0.6, 0.6, 1.0)


class SurroundingsMarkers:
    """Shows what is around the scene's objects; it changes with the scene alone."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise for the scene of `simulation`; its floor is written among `files`."""
        self._simulation = simulation
        self._files = files
        self._shown: tuple[Scene, int] | None = None  # of which scene the floor, by its body
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/surroundings", WORDS)

    def update(self) -> None:
        """Publish what is new, if anybody listens."""
        self._topic.repeat()
        scene = self._simulation.scene
        if self._shown == (scene, scene.floor) or not self._topic.due():
            return
        self._shown = scene, scene.floor
        dome: Any = sky.dome().reshape(-1, 6).tolist()
        markers = [_painted("sky", _SKY, dome), _ground(self._simulation.parameters.scene.floor.size / 2)]
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
    """Return a disc, darker than the floor, that fades into the sky; `half` is half of the floor's side, m."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SECTORS + 1)
    rings = [[(0.0, 0.0, _BELOW, *_GROUND[0][1])] * len(angles)]
    for beyond, colour in _GROUND:
        radius = half + beyond
        rings.append([(radius * np.cos(a), radius * np.sin(a), _BELOW, *colour) for a in angles])
    return _painted("ground", 1.0, [corner for near, far in itertools.pairwise(rings) for corner in band(near, far)])


def _painted(name: str, scale: float, corners: Sequence[Sequence[float]]) -> Marker:
    """Return a marker of triangles' corners: x, y, z, red, green, blue."""
    points = [corner[:3] for corner in corners]
    marker = new_marker(Marker.TRIANGLE_LIST, (1, 1, 1, 1), [scale] * 3, points, ns=name)
    marker.colors = [ColorRGBA(*corner[3:], 1.0) for corner in corners]
    return marker
