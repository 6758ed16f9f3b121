"""The markers of a scene, applied as rviz applies them, and the markers that are expected from the object tree."""

import contextlib

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.ros.rviz import marker_topics
from drone_sim.ros.rviz.scene_markers import RvizMeshes, SceneMarkers
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.scene.kinds.paths import PathParameters

TOLERANCE = 1e-5  # m


class Rviz:
    """A subscriber to a marker topic that stores the shown markers by namespace and id."""

    def __init__(self):
        self.shown = {}

    def get_num_connections(self):
        return 1

    def publish(self, message):
        marker_ids = [(one.ns, one.id) for one in message.markers]
        assert len(set(marker_ids)) == len(marker_ids), "namespace and id must be unique within a message"
        for one in message.markers:
            if one.action == Marker.DELETEALL:
                self.shown.clear()
            elif one.action == Marker.DELETE:
                self.shown.pop((one.ns, one.id), None)
            else:
                self.shown[one.ns, one.id] = one

    def assert_agrees(self, simulation):
        """Assert that exactly the objects of the tree are shown, with their positions, sizes and colors."""
        shown_by_name = {}
        for (name, _), one in sorted(self.shown.items()):
            shown_by_name.setdefault(name, []).append(one)
        expected = {one.name: looks for one in _entries(simulation) if (looks := _expected_markers(simulation, one))}
        assert shown_by_name.keys() == expected.keys()
        for name, looks in expected.items():
            assert len(shown_by_name[name]) == len(looks), name
            for marker, (place, size, color) in zip(shown_by_name[name], looks):
                assert np.allclose(_position_of(marker), place, atol=TOLERANCE), name
                assert np.allclose(_xyz(marker.scale), size), name
                assert color is None or np.allclose([marker.color.r, marker.color.g, marker.color.b], color[:3]), name


@contextlib.contextmanager
def rviz_of(simulation):
    """Yield an Rviz for a simulation's scene, and a function that publishes changes to it without throttling."""
    rviz = Rviz()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(marker_topics.rospy, "Publisher", lambda *_, **__: rviz)
        patch.setattr(marker_topics, "Throttle", lambda _: _Always())
        markers = SceneMarkers(simulation, RvizMeshes())
        yield rviz, markers.update


class _Always:
    def passes(self):
        return True


def _entries(simulation):
    scene = simulation.scene
    return [record.present for record in scene.records.values()]


def _expected_markers(simulation, entry):
    """Return position (of a line: its points), size and color of each marker that is expected for an entry."""
    tree = simulation.context.objects
    one = tree[tree.handle(entry.name)]
    matrix = one.matrix()
    if isinstance(one, Dummy):
        return [(frames.position(matrix), [one.size] * 3, None)]
    if isinstance(entry, PathParameters):
        return [([frames.transform(matrix, point) for point in one.points], [0.01, 0, 0], None)]
    if getattr(entry, "shape", "") == "compound":
        return [(frames.transform(matrix, part.position), _box(part), part.color) for part in entry.parts]
    return [(frames.position(matrix), _box(entry), entry.color)] if hasattr(entry, "shape") else []


def _box(shape_parameters):
    """Return the size of the box around a shape."""
    first, *others = shape_parameters.size
    sizes_by_shape = {"box": [first, *others], "sphere": [2 * first] * 3, "cylinder": [2 * first, 2 * first, *others]}
    return sizes_by_shape[shape_parameters.shape]


def _position_of(marker):
    is_line = marker.type == Marker.LINE_STRIP
    return [_xyz(one) for one in marker.points] if is_line else _xyz(marker.pose.position)


def _xyz(of):
    return [of.x, of.y, of.z]
