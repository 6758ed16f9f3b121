"""The scene's objects in rviz, which knows the robot alone: `<drone>/scene`, a latched MarkerArray."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.files.mesh_files import WHITE
from drone_sim.mechanics import frames
from drone_sim.ros.rviz import frame_markers, lit_triangles
from drone_sim.ros.rviz.marker_topic import MarkerTopic, namespace
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.run.simulation import Simulation
from drone_sim.shapes.primitive import Primitive
from drone_sim.shapes.triangles import Rgba
from drone_sim.shapes.visual import Visual

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


class SceneMarkers:
    """Shows the objects of the scene as they stand, each in a namespace of its name. The floor is not among them."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise where all that flies has its topics: see marker_topic.namespace."""
        self._simulation = simulation
        self._files = files
        self._shown: tuple[list[Visual], np.ndarray] | None = None
        self._frames: list[Marker] = []  # of what has no body
        self._topic = MarkerTopic(f"{namespace(simulation)}/scene", _PERIOD)

    def update(self) -> None:
        """Publish what has moved, come or gone, if anybody listens."""
        self._topic.repeat()
        if not self._topic.due():
            return
        visuals, poses = self._simulation.scene.visuals()
        bodiless = [*frame_markers.markers_of(self._simulation.scene.objects_now().values())]
        same = self._shown and visuals == self._shown[0] and np.array_equal(poses, self._shown[1])
        if same and bodiless == self._frames:
            return
        self._shown, self._frames = (visuals, poses), copy.deepcopy(bodiless)
        markers = [Marker(action=Marker.DELETEALL)]
        for name, visual, pose in zip(self._simulation.scene.visual_names(), visuals, poses):
            made = markers_of(visual, tuple(pose[:3].ravel().tolist()), self._files)
            for marker in made:
                marker.ns = name
            markers += made
        markers += bodiless
        for marker in markers:
            marker.frame_locked = True
        self._topic.show(markers)


def markers_of(visual: Visual, matrix: frames.Matrix, files: RvizMeshes) -> Sequence[Marker]:
    """Return what rviz makes of one visual at `matrix`, with its texture where the cameras show one, too."""
    if visual.texture and visual.shape.has_uv:
        try:
            marker = _marker(Marker.MESH_RESOURCE, matrix, (1, 1, 1), _FROM_ITS_FILE)
            marker.mesh_resource, marker.mesh_use_embedded_materials = files.resource(visual, _GLOW), True
            return [marker]
        except (ValueError, OSError) as error:
            rospy.logwarn_throttle(5, f"rviz gets an object without texture: {error}")
    return [marker_of(one, matrix, visual.rgba) for one in visual.shape.for_rviz()]


def marker_of(primitive: Primitive, matrix: frames.Matrix, rgba: Rgba) -> Marker:
    """Return a primitive of a shape that stands at `matrix`, world from shape."""
    place = frames.multiply(matrix, primitive.local)
    marker = _marker(_KINDS[primitive.kind], place, primitive.scale, rgba)
    if primitive.kind == "triangles":
        lit_triangles.paint(marker, primitive.corners, place, rgba)
    if primitive.kind == "mesh":
        own = rgba == WHITE
        marker.mesh_resource, marker.mesh_use_embedded_materials = f"file://{primitive.file}", own
        marker.color = ColorRGBA(*(_FROM_ITS_FILE if own else rgba))
    return marker


def _marker(kind: int, matrix: frames.Matrix, size: Sequence[float], rgba: Sequence[float]) -> Marker:
    pose = Pose(Point(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))
    return Marker(type=kind, pose=pose, scale=Vector3(*size), color=ColorRGBA(*rgba))
