"""The scene's objects and the vehicles as they look, in rviz: `<drone>/scene` and `view/bodies`, latched MarkerArrays.

Dummies are small balls, paths are lines. Triangles are lit by the same sun as in the cameras' pictures: rviz's own lamp
moves with the viewpoint, and leaves sides black.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.files.mesh_files import WHITE
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.render.programs import TO_SUN
from drone_sim.ros.core import message_conversion
from drone_sim.ros.rviz.marker_topics import WORDS, MarkerTopic, namespace, new_marker
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.run.simulation import Simulation
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.shapes.shape import Corner, Primitive, Rgba
from drone_sim.shapes.visual import Visual
from drone_sim.vehicles.vehicle import Vehicle

_PERIOD = 0.19  # s of real time, between two looks at what has moved
_GLOW = 0.6  # of what is seen from behind the lamp
_KINDS = {
    "cube": Marker.CUBE,
    "sphere": Marker.SPHERE,
    "cylinder": Marker.CYLINDER,
    "mesh": Marker.MESH_RESOURCE,
    "triangles": Marker.TRIANGLE_LIST,
}
_FROM_ITS_FILE = (0.0, 0.0, 0.0, 0.0)  # the color by which rviz keeps a mesh's own
_DUMMY = (0.9, 0.9, 0.95, 0.8)
_PATH = (0.2, 0.5, 0.9, 0.8)
_WIDTH = 0.01  # m, of a line
_MOST = 2000  # points of a line
_SUN = np.array(TO_SUN) / np.linalg.norm(TO_SUN)
_FROM_BELOW, _FROM_ABOVE, _FROM_SUN = np.array([(0.42, 0.41, 0.40), (0.52, 0.54, 0.57), (0.54, 0.52, 0.48)])


class SceneMarkers:
    """Shows the objects of the scene as they stand, each in a namespace of its name. The floor is not among them."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise for the scene of `simulation`; what has a texture is written among `files`."""
        self._simulation = simulation
        self._files = files
        self._shown: tuple[list[Visual], list[str], np.ndarray] | None = None
        self._frames: list[Marker] = []  # of what has no body
        self._topic = MarkerTopic(f"{namespace(simulation)}/scene", _PERIOD)

    def update(self) -> None:
        """Publish what has moved, come or gone, if anybody listens."""
        self._topic.repeat()
        if not self._topic.due():
            return
        (visuals, poses), names = self._simulation.scene.visuals(), self._simulation.scene.visual_names()
        bodiless = [*bodiless_markers(self._simulation.scene.objects.values())]
        same = self._shown and (visuals, names) == self._shown[:2] and np.array_equal(poses, self._shown[2])
        if same and bodiless == self._frames:
            return
        self._shown, self._frames = (visuals, names, poses), copy.deepcopy(bodiless)
        markers = [Marker(action=Marker.DELETEALL)]
        for name, visual, pose in zip(names, visuals, poses):
            made = markers_of(visual, tuple(pose[:3].ravel().tolist()), self._files)
            for marker in made:
                marker.ns = name
            markers += made
        markers += bodiless
        for marker in markers:
            marker.frame_locked = True
        self._topic.show(markers)


class VehicleMarkers:
    """Shows every vehicle; published when one has come or gone.

    Each part hangs on the frame of its link, and so moves with it.
    """

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise for the vehicles of `simulation`; what has a texture is written among `files`."""
        self._simulation = simulation
        self._files = files
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/bodies", WORDS)
        self._shown = -1  # topology version

    def update(self) -> None:
        """Publish what is new, if anybody listens."""
        self._topic.repeat()
        if self._simulation.topology_version != self._shown and self._topic.due():
            self._shown = self._simulation.topology_version
            looks = [one for vehicle in self._simulation.vehicles.values() for one in self._looks(vehicle)]
            self._topic.show([Marker(action=Marker.DELETEALL), *looks])  # some have gone, or have another name

    def _looks(self, vehicle: Vehicle) -> list[Marker]:
        markers = []
        for visual, (link, matrix) in zip(
            self._simulation.world.pictures.visuals([vehicle.body.number]), vehicle.body.visual_places
        ):
            for marker in markers_of(visual, matrix, self._files):
                marker.header.frame_id = message_conversion.frame(vehicle.parameters, link)
                marker.ns, marker.frame_locked = vehicle.name, True
                markers.append(marker)
        return markers


def markers_of(visual: Visual, matrix: frames.Matrix, files: RvizMeshes) -> Sequence[Marker]:
    """Return what rviz makes of one visual at `matrix`, with its texture where the cameras show one, too."""
    if visual.texture and visual.shape.has_uv:
        try:
            marker = _marker(Marker.MESH_RESOURCE, matrix, (1, 1, 1), _FROM_ITS_FILE)
            marker.mesh_resource, marker.mesh_use_embedded_materials = files.resource(visual, _GLOW), True
            return [marker]
        except (ValueError, OSError) as error:
            rospy.logwarn_throttle(5, f"rviz shows an object without its texture: {error}")
    return [marker_of(one, matrix, visual.rgba) for one in visual.shape.for_rviz()]


def marker_of(primitive: Primitive, matrix: frames.Matrix, rgba: Rgba) -> Marker:
    """Return a primitive of a shape that stands at `matrix`, world from shape."""
    place = frames.multiply(matrix, primitive.local)
    marker = _marker(_KINDS[primitive.kind], place, primitive.scale, rgba)
    if primitive.kind == "triangles":
        _paint(marker, primitive.corners, place, rgba)
    if primitive.kind == "mesh":
        own = rgba == WHITE
        marker.mesh_resource, marker.mesh_use_embedded_materials = f"file://{primitive.file}", own
        marker.color = ColorRGBA(*(_FROM_ITS_FILE if own else rgba))
    return marker


def _marker(kind: int, matrix: frames.Matrix, size: Sequence[float], rgba: Sequence[float]) -> Marker:
    return Marker(type=kind, pose=message_conversion.pose(matrix), scale=Vector3(*size), color=ColorRGBA(*rgba))


def bodiless_markers(objects: Iterable[SceneObject]) -> Iterator[Marker]:
    """Yield a marker for each dummy and each path among some objects, in the frame `world`."""
    for one in objects:
        if isinstance(one, Dummy):
            ball = new_marker(Marker.SPHERE, _DUMMY, [one.size] * 3, ns=one.name)
            ball.pose.position = Point(*frames.position(one.matrix()))
            yield ball
        elif isinstance(one, Path):
            every, matrix = -(-len(one.points) // _MOST), one.matrix()
            points = [frames.transform(matrix, point) for point in (*one.points[:-1:every], one.points[-1])]
            yield new_marker(Marker.LINE_STRIP, _PATH, (_WIDTH, 0, 0), points, ns=one.name)


def _paint(marker: Marker, corners: tuple[Corner, ...], matrix: Matrix, rgba: Sequence[float]) -> None:
    """Make a marker at `matrix`, as large as its scale says, these triangles (three corners each, m) of this colour."""
    points, normals = _triangles(corners)
    scale = marker.scale.x, marker.scale.y, marker.scale.z
    marker.type, marker.points = Marker.TRIANGLE_LIST, points
    colors: Any = np.minimum(_light(normals / scale, matrix) * rgba[:3], 1.0).tolist()
    for red, green, blue in colors:
        marker.colors += [ColorRGBA(red, green, blue, rgba[3])] * 3


@lru_cache
def _triangles(corners: tuple[Corner, ...]) -> tuple[list[Point], np.ndarray]:
    """Return the corners as rviz wants them, and the triangles' normals (m, 3), of any length."""
    first, second, third = np.moveaxis(np.reshape(corners, (-1, 3, 3)), 1, 0)
    return [Point(*corner) for corner in corners], np.cross(second - first, third - first)


def _light(normals: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return what surfaces with these normals (m, 3) get of red, green and blue: as in the cameras' shaders."""
    turned = normals @ np.reshape(matrix, (3, 4))[:, :3].T
    turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30)
    share = 0.5 + 0.5 * turned[:, 2:]
    ambient = (1 - share) * _FROM_BELOW + share * _FROM_ABOVE
    return np.asarray(ambient + _FROM_SUN * np.maximum(0.85 * (turned @ _SUN)[:, None] + 0.15, 0.0))
