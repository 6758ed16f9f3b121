"""The cockpit's handles without a browser: markers shown, the browser that holds a handle, feedback published."""

import json

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from browser_scene import Browser, marker
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
)
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback

from drone_sim.ros.cockpit.scene.handles import Drag, DragControls, read_drag
from drone_sim.ros.cockpit.scene.scene_view import read_push

HERE, THERE = (1.0, 0, 0, 0, 0, 0, 1), (2.0, 0, 0, 0, 0, 0, 1)


class RecordedHandles:
    """Handles whose feedback is recorded: one marker at (1, 0, 0), turned by 90 degrees, with one visible sphere."""

    def __init__(self):
        self.feedback, self.now, self.browser = [], 0.0, Browser()
        self.handles = DragControls("markers", self.feedback.append, clock=lambda: self.now)
        ball, unseen = marker(0, Marker.SPHERE), marker(1, Marker.SPHERE)
        unseen.color = ColorRGBA(0, 0, 0, 0.01)
        looks = InteractiveMarkerControl(always_visible=True, markers=[ball, unseen])
        pose = Pose(Point(1, 0, 0), Quaternion(0, 0, 0.5**0.5, 0.5**0.5))
        self.handles.on_init(InteractiveMarkerInit(markers=[InteractiveMarker(name="a", pose=pose, controls=[looks])]))
        self.show()

    def show(self):
        self.browser.state.change({}, self.handles.take())
        return self.browser.hear()

    def hear(self, x):
        pose = InteractiveMarkerPose(name="a", pose=Pose(Point(x, 0, 0), Quaternion(0, 0, 0, 1)))
        self.handles.on_update(InteractiveMarkerUpdate(poses=[pose]))
        return self.show()

    def drag(self, phase, pose=HERE, browser=1):
        self.handles.drag(browser, Drag("markers", "a", phase, pose))

    @property
    def kinds(self):
        return [one.event_type for one in self.feedback]


@pytest.fixture(name="dragged")
def _dragged():
    return RecordedHandles()


def test_a_handle_is_shown_with_its_pose_and_its_visible_markers(dragged):
    data = {one["kind"]: one for one in dragged.browser.named("a")}
    assert set(data) == {"handle", "sphere"} and data["handle"]["layer"] == "markers"
    for one in data.values():
        assert one["pose"] == pytest.approx((1, 0, 0, 0, 0, 0.5**0.5, 0.5**0.5)) and one["frame"] == "world"
    feedback = dragged.hear(x=1.5)
    assert len(feedback["placed"]) == 2 and not feedback["markers"]
    assert {one["pose"][0] for one in dragged.browser.named("a")} == {1.5}
    dragged.handles.on_update(InteractiveMarkerUpdate(erases=["a"]))
    dragged.show()
    assert not dragged.browser.markers


def test_a_drag_is_published_as_marker_feedback(dragged):
    for phase, pose in (("start", HERE), ("move", THERE), ("end", THERE)):
        dragged.drag(phase, pose)
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.POSE_UPDATE, Feedback.MOUSE_UP]
    data = dragged.feedback[1]
    assert (data.marker_name, data.header.frame_id, data.pose.position.x) == ("a", "world", 2.0)
    assert data.client_id == "cockpit/1"


def test_a_handle_held_still_publishes_keep_alive(dragged):
    dragged.drag("start")
    for dragged.now in (0.1, 0.3, 0.4):
        dragged.handles.keep((1,))
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.KEEP_ALIVE]


def test_a_disconnected_browser_releases_its_handle(dragged):
    dragged.drag("start")
    dragged.handles.keep((2,))
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.MOUSE_UP]
    dragged.drag("move", THERE)
    assert len(dragged.feedback) == 2, "a late move is ignored"


def test_a_second_browser_cannot_drag_until_the_first_releases_the_handle(dragged):
    dragged.drag("start", browser=1)
    for phase in ("start", "move", "end"):
        dragged.drag(phase, THERE, browser=2)
    assert dragged.kinds == [Feedback.MOUSE_DOWN]
    dragged.drag("end", browser=1)
    dragged.drag("start", browser=2)
    assert [one.client_id for one in dragged.feedback] == ["cockpit/1"] * 2 + ["cockpit/2"]


def test_a_handle_erased_during_a_drag_is_released(dragged):
    dragged.drag("start")
    dragged.handles.on_update(InteractiveMarkerUpdate(erases=["a"]))
    dragged.handles.keep((1,))
    assert dragged.kinds == [Feedback.MOUSE_DOWN, Feedback.MOUSE_UP]
    dragged.drag("start")
    assert len(dragged.feedback) == 2, "an erased handle cannot be dragged"


GOOD = {"drag": "move", "server": "markers", "name": "a", "pose": [1, 2, 3, 0, 0, 0, 2]}


def test_a_drag_message_is_parsed():
    assert read_drag(GOOD) == Drag("markers", "a", "move", (1, 2, 3, 0, 0, 0, 1))


@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"drag": "throw"}, "drag = 'throw': must be one of start, move, end"),
        ({"drag": {}}, "drag = {}: must be one of"),
        ({"name": 3}, "name = 3: must be a name"),
        ({"server": None}, "server = None: must be a name"),
        *(
            ({"pose": pose}, "pose: must be x, y, z")
            for pose in (None, [], [0] * 7, [1e9, 0, 0, 0, 0, 0, 1], ["1", 0, 0, 0, 0, 0, 1], [True, 0, 0, 0, 0, 0, 1])
        ),
    ],
)
def test_an_invalid_drag_message_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        read_drag({**GOOD, **wrong})


@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"push": 1}, "push = 1: must be the name of a vehicle"),
        ({"ray": [0, 0, 0]}, "ray: must be x, y and z"),
        ({"ray": [1, 0]}, "ray: must be x, y and z"),
        ({"newtons": -1}, "newtons = -1: must be a number above 0"),
        ({"newtons": 1000}, "newtons = 1000: must be"),
        ({"newtons": True}, "newtons = True: must be"),
    ],
)
def test_an_invalid_push_message_is_refused(wrong, words):
    good = {"push": "drone", "ray": [1, 0, 0], "newtons": 0.5}
    assert read_push(good) == ("drone", [1, 0, 0], 0.5)
    with pytest.raises(ValueError, match=words):
        read_push(json.loads(json.dumps({**good, **wrong})))
