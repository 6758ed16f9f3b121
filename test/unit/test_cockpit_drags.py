"""The cockpit's handles, and its light, without a browser."""

import io

import pytest

pytest.importorskip("rospy", reason="needs ROS")
pytest.importorskip("viser")

import numpy as np
import trimesh
from browser_scene import Scene, marker
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
)
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from drone_sim.ros.cockpit.scene import looks
from drone_sim.ros.cockpit.scene.frames import FrameTree
from drone_sim.ros.cockpit.scene.handles import DragControls, Selection
from drone_sim.ros.cockpit.scene.markers import MarkerNodes
from drone_sim.ros.cockpit.scene.scene_view import Sunlight


class Dragged:
    """Handles whose feedback is kept, with one marker at (1, 0, 0), turned by 90 degrees."""

    def __init__(self, **options):
        self.scene, self.said, self.now = Scene(), [], 0.0
        self.handles = DragControls(self.scene, self.said.append, clock=lambda: self.now, **options)
        self.hear(x=1.0)

    def hear(self, **position):
        pose = Pose(Point(**position), Quaternion(0, 0, 0.5**0.5, 0.5**0.5))
        self.handles.on_init(InteractiveMarkerInit(markers=[InteractiveMarker(name="a", pose=pose)]))
        self.handles.show((1, 2))

    @property
    def kinds(self):
        return [one.event_type for one in self.said]

    def place(self):
        return self.scene.nodes["/handles/a"].position


@pytest.fixture(name="dragged")
def _dragged():
    return Dragged()


def test_a_handle_follows_unless_it_is_dragged(dragged):
    arrows = dragged.scene.nodes["/handles/a"]
    assert arrows.position == (1.0, 0.0, 0.0) and arrows.wxyz == (0.5**0.5, 0, 0, 0.5**0.5)
    arrows.drag("start")
    assert dragged.handles.held
    arrows.drag("update", position=(2.0, 0.0, 0.0))
    dragged.hear(x=1.5)
    assert dragged.place() == (2.0, 0.0, 0.0)
    arrows.drag("end")
    dragged.hear(x=1.9)
    assert dragged.place() == (1.9, 0.0, 0.0) and not dragged.handles.held
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.POSE_UPDATE, Feedback.MOUSE_UP]
    told = dragged.said[1]
    assert (told.marker_name, told.header.frame_id, told.pose.position.x) == ("a", "world", 2.0)


def test_the_ring_turns_about_the_vertical(dragged):
    ring = dragged.scene.nodes["/handles/a/turn"]
    ring.drag("start")
    ring.drag("update", wxyz=(0.5**0.5, 0.0, 0.0, 0.5**0.5))
    turn = dragged.said[-1].pose.orientation
    assert (abs(turn.z), abs(turn.w)) == pytest.approx((1, 0), abs=1e-9), "180 degrees in all"
    ring.drag("end")
    dragged.handles.show((1,))
    assert ring.wxyz == (1.0, 0.0, 0.0, 0.0), "the arrows have turned instead"
    assert abs(dragged.scene.nodes["/handles/a"].wxyz[3]) == pytest.approx(1)


def test_a_handle_that_is_held_still_is_told_again(dragged):
    dragged.scene.nodes["/handles/a"].drag("start")
    for dragged.now in (0.1, 0.3, 0.4):
        dragged.handles.show((1,))
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.KEEP_ALIVE]


def test_a_browser_that_is_gone_lets_go(dragged):
    dragged.scene.nodes["/handles/a"].drag("start")
    dragged.handles.show((2,))
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.MOUSE_UP] and not dragged.handles.held


def test_a_marker_that_goes_while_it_is_held_takes_its_handle_along(dragged):
    arrows = dragged.scene.nodes["/handles/a"]
    arrows.drag("start")
    dragged.handles.on_update(InteractiveMarkerUpdate(erases=["a"]))
    dragged.handles.show((1,))
    assert not dragged.scene.nodes and dragged.kinds[-1] == Feedback.MOUSE_UP
    arrows.drag("update")
    assert len(dragged.said) == 2, "what comes late is nothing"


def test_only_the_object_that_is_chosen_has_arrows():
    choice = Selection()
    dragged = Dragged(is_offered=lambda name: name == choice.name)
    assert not dragged.scene.nodes and dragged.handles.names == ("a",)
    choice.toggle("a")
    dragged.handles.show()
    assert "/handles/a" in dragged.scene.nodes
    choice.toggle("a")
    dragged.handles.show()
    assert not dragged.scene.nodes


# ---- light


def test_solid_objects_throw_shadows_on_the_floor_if_they_are_wanted():
    scene = Scene()
    sun = Sunlight(scene)
    light = scene.nodes["/sun"]
    assert not scene.lit and light.position[2] > abs(light.position[0]) > 0
    floor, wall = (looks.show(scene, f"/{name}", marker(0)) for name in ("floor", "wall"))
    sun.shine_on(Marker(ns="floor"), floor)
    sun.shine_on(Marker(ns="wall"), wall)
    assert floor.receive_shadow > 0 and wall.receive_shadow is False
    sun.cast(False)
    assert floor.receive_shadow is False and light.cast_shadow is False
    glass = marker(1)
    glass.color.a = 0.5
    shadows = [looks.show(scene, "/x", one, casts=True).options["cast_shadow"] for one in (marker(0), glass)]
    assert shadows == [True, False]


def test_an_object_called_sky_is_shown():
    scene = Scene()
    markers = MarkerNodes(scene, "scene", FrameTree(scene))
    sky = marker(0)
    sky.ns = "sky"
    markers.on_markers(MarkerArray([sky]))
    markers.show()
    assert scene.nodes


def test_colours_look_as_they_do_in_the_cameras():
    painted = marker(0, Marker.TRIANGLE_LIST, points=[Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)])
    painted.color = ColorRGBA(0.5, 1.0, 0.0, 1.0)
    data = looks.show(Scene(), "/x", painted).arguments[0]
    (mesh,) = trimesh.load(io.BytesIO(data), file_type="glb").geometry.values()
    np.testing.assert_array_equal(
        mesh.visual.vertex_attributes["color"][0], (55, 255, 0, 255), "0.5 is 21.4 % of the light"
    )


def test_what_changes_too_little_to_be_seen_or_is_only_rvizs_light_is_not_made_anew():
    def shown(alpha, size):
        painted = marker(0, Marker.TRIANGLE_LIST, points=[Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)])
        painted.colors = [ColorRGBA(0, 0, 0, alpha)] * 3
        painted.scale.x = size
        return painted

    for casts, alphas, made in ((False, (0.5, 0.501), 1), (False, (0.5, 0.7), 2), (True, (0.5, 0.7), 1)):
        scene = Scene()
        markers = MarkerNodes(scene, "scene", FrameTree(scene), casts=casts)
        for alpha, size in zip(alphas, (1.0, 1.001)):
            markers.on_markers(MarkerArray([shown(alpha, size)]))
            markers.show()
        assert len(scene.added) == made, (casts, alphas)
