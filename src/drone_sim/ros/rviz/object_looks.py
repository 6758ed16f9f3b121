"""What the mouse meets of an object of the scene in rviz: its shape once more, a little larger and not to be seen."""

from __future__ import annotations

from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.ros.rviz import frame_markers
from drone_sim.ros.rviz.marker_server import pose_message
from drone_sim.ros.rviz.scene_markers import marker_of
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.scene.scene import Scene
from drone_sim.shapes.visual import Visual

_UNSEEN = (0.2, 0.6, 1.0, 0.01)  # rviz picks no marker that is transparent altogether
_AROUND = 1.02  # times as large as what it stands for, so that the mouse meets it first


class ObjectLooks:
    """The looks of all that is in a scene now."""

    def __init__(self, scene: Scene):
        """Look."""
        self._found: dict[str, list[tuple[Visual, Matrix]]] = {}
        for name, visual, pose in zip(scene.visual_names(), *scene.visuals()):
            self._found.setdefault(name, []).append((visual, tuple(pose[:3].ravel().tolist())))

    def markers(self, name: str, one: SceneObject, handle: Matrix) -> list[Marker]:
        """Return the markers of an object in the frame of its handle, world from it; none for what has no shape."""
        made = []
        for visual, matrix in self._found.get(name, ()):
            local = frames.relative(handle, matrix)
            made += [marker_of(primitive, local, _UNSEEN) for primitive in visual.shape.for_rviz()]
        if isinstance(one, Dummy):
            made += frame_markers.markers_of([one])
            made[-1].pose = pose_message(frames.IDENTITY)
        for marker in made:
            for axis in "xyz":
                setattr(marker.scale, axis, _AROUND * getattr(marker.scale, axis))
        return made
