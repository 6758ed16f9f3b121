"""The scene's objects in rviz, which knows the robot alone: `<drone>/scene`, a latched MarkerArray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.render.mesh import WHITE
from drone_sim.ros.rviz import boxes
from drone_sim.ros.rviz.marker_topic import namespace
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.ros.vehicle.messages import WORLD
from drone_sim.run.pacing import Throttle
from drone_sim.run.simulation import Simulation
from drone_sim.shapes.visual import Visual

_PERIOD = 0.19  # s of real time, between two looks at what has moved
_FLAT = 1e-3  # m, thickness of a plane
_WIDE = 200.0  # m, its side
_GLOW = 0.6  # of what is seen from behind the lamp
_TEXTURED = ("box", "mesh")
_FROM_ITS_FILE = (0.0, 0.0, 0.0, 0.0)  # the color by which rviz keeps a mesh's own


class SceneMarkers:
    """Shows the objects of the scene as they stand. The floor is not among them."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        self._files = files
        self._throttle = Throttle(_PERIOD)
        self._shown: tuple[list[Visual], np.ndarray] | None = None
        name = f"{namespace(simulation)}/scene"
        self._publisher = rospy.Publisher(name, MarkerArray, queue_size=1, latch=True)

    def update(self) -> None:
        """Publish what has moved, come or gone, if anybody listens."""
        if not self._publisher.get_num_connections() or not self._throttle.passes():
            return
        visuals, poses = self._simulation.scene.visuals()
        if self._shown and visuals == self._shown[0] and np.array_equal(poses, self._shown[1]):
            return
        self._shown = visuals, poses
        markers = [Marker(action=Marker.DELETEALL)]
        for visual, pose in zip(visuals, poses):
            markers += markers_of(visual, tuple(pose[:3].ravel().tolist()), self._files)
        for number, marker in enumerate(markers):
            marker.header.frame_id, marker.ns, marker.id = WORLD, "scene", number
            marker.frame_locked = True
        self._publisher.publish(MarkerArray(markers))


def markers_of(visual: Visual, matrix: frames.Matrix, files: RvizMeshes) -> Sequence[Marker]:
    """Return what rviz makes of one visual at `matrix`, with its texture where the cameras show one, too."""
    if visual.texture and visual.shape in _TEXTURED:
        try:
            marker = _marker(Marker.MESH_RESOURCE, matrix, (1, 1, 1), _FROM_ITS_FILE)
            marker.mesh_resource, marker.mesh_use_embedded_materials = files.resource(visual, _GLOW), True
            return [marker]
        except (ValueError, OSError) as error:
            rospy.logwarn_throttle(5, f"rviz gets an object without texture: {error}")
    return _markers(visual, matrix)


def _markers(visual: Visual, matrix: frames.Matrix) -> Sequence[Marker]:
    """Return what rviz makes of one visual: one marker, three for a capsule."""
    size, rgba = visual.size, visual.rgba
    if visual.shape == "box":
        box = _marker(Marker.TRIANGLE_LIST, matrix, size, rgba)
        boxes.paint(box, matrix, rgba)
        return [box]
    if visual.shape == "plane":
        return [_marker(Marker.CUBE, matrix, (_WIDE, _WIDE, _FLAT), rgba)]
    if visual.shape == "mesh":
        own = rgba == WHITE
        mesh = _marker(Marker.MESH_RESOURCE, matrix, size, _FROM_ITS_FILE if own else rgba)
        mesh.mesh_resource, mesh.mesh_use_embedded_materials = f"file://{visual.file}", own
        return [mesh]
    wide = 2 * size[0]
    if visual.shape == "sphere":
        return [_marker(Marker.SPHERE, matrix, (wide, wide, wide), rgba)]
    tube = _marker(Marker.CYLINDER, matrix, (wide, wide, size[1]), rgba)
    if visual.shape == "cylinder":
        return [tube]
    ends = [frames.multiply(matrix, frames.from_rpy((0, 0, sign * size[1] / 2), (0, 0, 0))) for sign in (-1, 1)]
    return [tube, *(_marker(Marker.SPHERE, end, (wide, wide, wide), rgba) for end in ends)]


def _marker(kind: int, matrix: frames.Matrix, size: Sequence[float], rgba: Sequence[float]) -> Marker:
    pose = Pose(Point(*frames.position(matrix)), Quaternion(*frames.to_quaternion(matrix)))
    return Marker(type=kind, pose=pose, scale=Vector3(*size), color=ColorRGBA(*rgba))
