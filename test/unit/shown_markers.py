"""What rviz shows of a scene: its markers, applied as rviz applies them; and what the tree says it should show."""

import contextlib

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.ros.rviz import marker_topics
from drone_sim.ros.rviz.scene_markers import RvizMeshes, SceneMarkers
from drone_sim.scene.kinds.dummy import Dummy
from drone_sim.scene.kinds.paths import PathParameters

FAR = 1e-5  # m


class Rviz:
    """Somebody who listens to a topic of markers, and keeps by namespace and id what is to be seen."""

    def __init__(self):
        self.shown = {}

    def get_num_connections(self):
        return 1

    def publish(self, message):
        told = [(one.ns, one.id) for one in message.markers]
        assert len(set(told)) == len(told), "rviz takes one of each namespace and id in a message"
        for one in message.markers:
            if one.action == Marker.DELETEALL:
                self.shown.clear()
            elif one.action == Marker.DELETE:
                self.shown.pop((one.ns, one.id), None)
            else:
                self.shown[one.ns, one.id] = one

    def assert_agrees(self, simulation):
        """See that it shows the objects of the tree, where and as large as those are, and nothing else."""
        seen = {}
        for (name, _), one in sorted(self.shown.items()):
            seen.setdefault(name, []).append(one)
        wanted = {one.name: looks for one in _now(simulation) if (looks := _looks(simulation, one))}
        assert seen.keys() == wanted.keys()
        for name, looks in wanted.items():
            assert len(seen[name]) == len(looks), name
            for marker, (place, size, color) in zip(seen[name], looks):
                assert np.allclose(_place(marker), place, atol=FAR), name
                assert np.allclose(_xyz(marker.scale), size), name
                assert color is None or np.allclose([marker.color.r, marker.color.g, marker.color.b], color[:3]), name


@contextlib.contextmanager
def rviz_of(simulation):
    """Give what rviz shows of a simulation's scene, and what lets it hear the news at once."""
    rviz = Rviz()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(marker_topics.rospy, "Publisher", lambda *_, **__: rviz)
        patch.setattr(marker_topics, "Throttle", lambda _: _Always())
        markers = SceneMarkers(simulation, RvizMeshes())
        yield rviz, markers.update


class _Always:
    def passes(self):
        return True


def _now(simulation):
    scene = simulation.scene
    return [record.present for record in scene.records.values()]


def _looks(simulation, entry):
    """Return the places (of lines: of their points), sizes and colors of the markers of one entry."""
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


def _box(said):
    """Return the size of the box around a shape."""
    first, *others = said.size
    known = {"box": [first, *others], "sphere": [2 * first] * 3, "cylinder": [2 * first, 2 * first, *others]}
    return known[said.shape]


def _place(marker):
    is_line = marker.type == Marker.LINE_STRIP
    return [_xyz(one) for one in marker.points] if is_line else _xyz(marker.pose.position)


def _xyz(of):
    return [of.x, of.y, of.z]
