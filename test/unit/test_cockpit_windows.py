"""Camera pictures and windows of scripts on their way to the browsers, without a browser."""

import asyncio
import json
import re
from typing import ClassVar
from unittest import mock

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import cv2
import rospy
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from drone_sim.ros.cockpit.panel import cameras as cameras_module
from drone_sim.ros.cockpit.panel.board import Board
from drone_sim.ros.cockpit.panel.cameras import CameraSwitches, ScriptWindows, camera_name, encode
from drone_sim.ros.cockpit.panel.image_conversion import css_color
from drone_sim.ros.cockpit.server.page_socket import SendQueue
from drone_sim.ros.cockpit.topics import ImageTopic, find_topics
from drone_sim.ros.core import image_messages


async def take_all(box):
    """Return all messages that a queue gives without waiting."""
    found = []
    while True:
        task = asyncio.create_task(box.take())
        await asyncio.sleep(0)
        if not task.done():
            task.cancel()
            return found
        found.append(task.result())


def test_a_browser_gets_the_latest_picture_once_it_has_shown_the_last_one():
    async def talk():
        box = SendQueue()
        for number in range(1000):
            box.put_picture("front", b"%d" % number)
        assert await take_all(box) == [b"999"] and not box.wants("front")
        box.put_picture("front", b"1000")
        box.put_picture("front", b"1001")
        assert await take_all(box) == [], "the first picture has not been shown yet"
        box.shown("front")
        assert await take_all(box) == [b"1001"]
        box.put_picture("front", b"1002")
        box.forget("front")
        assert await take_all(box) == [] and box.wants("front")

    asyncio.run(talk())


def test_the_queue_of_a_browser_that_receives_nothing_is_bounded():
    async def talk():
        box = SendQueue()
        for number in range(1000):
            box.put(str(number))
        assert await take_all(box) == [str(number) for number in range(968, 1000)]

    asyncio.run(talk())


# ---- pictures


def picture(content):
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)


def message(image, encoding):
    return image_messages.image(image, encoding)


def test_compressed_pictures_are_passed_on_unchanged():
    assert encode(CompressedImage(data=b"\xff\xd8 a JPEG")) == (b"\xff\xd8 a JPEG", "")


@pytest.mark.parametrize("encoding, unit", [("32FC1", 1.0), ("16UC1", 1000)])
def test_depths_are_coloured_with_a_legend(encoding, unit):
    depths = np.full((60, 80), 2.0)
    depths[:, 40:] = 8.0
    depths[:20] = 0.0
    content, note = encode(message((depths * unit).astype(np.uint16 if unit == 1000 else np.float32), encoding))
    assert note == "2.00 m (blue) to 8.00 m (red)"
    near, far, nothing = (picture(content)[at].astype(int) for at in ((40, 10), (40, 70), (5, 40)))
    assert near[0] > near[2] and far[2] > far[0] and nothing.max() < 20


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_invalid_depths_are_black(value):
    content, note = encode(message(np.full((10, 10), value, np.float32), "32FC1"))
    assert picture(content).max() == 0 and note == "nothing within range"


def test_colour_and_grey_pictures_of_any_encoding_are_scaled_down():
    red = np.zeros((8, 2000, 3), np.uint8)
    red[:, :, 0] = 255
    shown = picture(encode(message(red, "rgb8"))[0])
    assert shown.shape[1] == 500 and shown[1, 250, 2] > 200 > 50 > shown[1, 250, 0]
    assert picture(encode(message(red, "bgr8"))[0])[1, 250, 0] > 200
    assert picture(encode(message(red, "8UC3"))[0])[1, 250, 0] > 200
    assert picture(encode(message(red.astype(np.uint16) * 257, "rgb16"))[0])[1, 100, 2] > 200
    assert picture(encode(message(np.full((4, 4), 200, np.uint8), "mono8"))[0])[2, 2].min() > 190
    red_under_its_filter = np.tile(np.array([[255, 0], [0, 0]], np.uint8), (20, 20))
    assert picture(encode(message(red_under_its_filter, "bayer_rggb8"))[0])[20, 20, 2] > 150


@pytest.mark.parametrize(
    "wrong",
    [
        Image(encoding="nonsense", height=1, width=1, step=1, data=b"1"),
        Image(encoding="rgb8", height=100, width=100, step=300, data=b"too short"),
        Image(encoding="rgb8"),
        Image(encoding="32FC3", height=1, width=1, step=12, data=b"123456789abc"),
    ],
)
def test_an_invalid_picture_gets_one_line(wrong):
    with pytest.raises(ValueError, match=r"^[^\n]+$"):
        encode(wrong)


def test_every_camera_is_offered_once():
    topics = [
        ("/drone/view/bodies", "visualization_msgs/MarkerArray"),
        ("/drone/front", "sensor_msgs/Image"),
        ("/drone/front/compressed", "sensor_msgs/CompressedImage"),
        ("/drone/depth/image", "sensor_msgs/Image"),
        ("/drone/depth/image/compressedDepth", "sensor_msgs/CompressedImage"),
        ("/robot/eye/compressed", "sensor_msgs/CompressedImage"),
    ]
    truth = [("/drone/front/truth/boxes", "std_msgs/String"), ("/drone/front/truth/categories", "sensor_msgs/Image")]
    assert find_topics([*topics, *truth]).cameras == (
        ImageTopic("/drone/depth/image"),
        ImageTopic("/drone/front", "/drone/front/compressed", has_truth=True),
        ImageTopic("/robot/eye", "/robot/eye/compressed"),
    )


# ---- switches


class SocketRecorder:
    """Records the messages and pictures that would be sent to the browsers."""

    def __init__(self):
        self.told, self.pictures = [], []
        self.ready = True

    def tell(self, message):
        self.told.append(message)

    def wants_picture(self, _name):
        return self.ready

    def show_picture(self, said, content):
        self.pictures.append((said, content))

    def close_picture(self, name):
        self.told.append(f"closed {name}")


class Subscriber:
    there: ClassVar[dict] = {}

    def __init__(self, topic, _kind, hear, **_options):
        self.topic = topic
        self.there[topic] = hear

    def unregister(self):
        del self.there[self.topic]


@pytest.fixture(name="sent")
def _sent():
    return SocketRecorder()


@pytest.fixture(name="cameras")
def _cameras(monkeypatch, sent):
    monkeypatch.setattr(cameras_module.rospy, "Subscriber", Subscriber)
    Subscriber.there.clear()
    found = CameraSwitches(Board(lambda _: None), sent)
    found.offer((ImageTopic("/drone/front", "/drone/front/compressed"), ImageTopic("/drone/depth/image")), ("drone",))
    return found


def test_a_camera_is_subscribed_only_while_a_browser_shows_it(cameras, sent):
    cameras.rest(False)
    assert not Subscriber.there
    cameras.turn("/drone/front", True)
    assert list(Subscriber.there) == ["/drone/front/compressed"] and sent.told == [{"pictures": ["/drone/front"]}]
    hear = Subscriber.there["/drone/front/compressed"]
    for number in range(3):
        hear(CompressedImage(data=b"%d" % number))
    cameras.show()
    cameras.show()
    assert sent.pictures == [({"picture": "/drone/front", "name": "front", "note": ""}, b"2")]
    sent.ready = False
    hear(CompressedImage(data=b"3"))
    cameras.show()
    assert len(sent.pictures) == 1, "no browser has shown the last picture yet"
    cameras.rest(True)
    assert not Subscriber.there
    cameras.rest(False)
    assert Subscriber.there
    cameras.turn("/drone/front", False)
    assert not Subscriber.there and sent.told[-2:] == ["closed /drone/front", {"pictures": []}]


def test_a_shown_camera_stays_on_while_another_scene_with_it_is_loaded(cameras, sent):
    cameras.rest(False)
    cameras.turn("/drone/front", True)
    front, depth = ImageTopic("/drone/front", "/drone/front/compressed"), ImageTopic("/drone/depth/image")
    cameras.offer(())  # the master is queried between the end of the old scene and the start of the new one
    assert not Subscriber.there
    cameras.offer((front, depth))
    assert cameras.shown == ["/drone/front"]
    assert list(Subscriber.there) == ["/drone/front/compressed"]
    cameras.turn("/drone/front", False)
    cameras.offer(())
    cameras.offer((front, depth))
    assert not cameras.shown, "a camera that was switched off stays off"


def test_boxes_and_mask_have_the_same_stamp_as_the_picture(cameras, sent):
    cameras.rest(False)
    cameras.offer((ImageTopic("/drone/front", has_truth=True), ImageTopic("/drone/depth/image")))
    cameras.turn("/drone/front", True)
    for wrong in (
        {"topic": "/drone/depth/image", "overlay": "mask", "on": True},
        {"topic": "/drone/front", "on": True},
    ):
        with pytest.raises(ValueError, match="does not exist"):
            cameras.answer_overlay(wrong)
    for kind in ("boxes", "mask"):
        cameras.answer_overlay({"topic": "/drone/front", "overlay": kind, "on": True})
    truth = {name: Subscriber.there[f"/drone/front/truth/{name}"] for name in ("labels", "boxes", "categories")}
    truth["labels"](String(json.dumps({"categories": {"1": "Gate"}})))
    mask = np.zeros((20, 30), np.uint16)
    mask[5:10, 5:10] = 1
    for at, name in ((0.05, "Before"), (0.1, "Now"), (0.15, "After")):
        boxes = [{"name": one, "category": "Gate", "visible": [4.5, 4.5, 9.5, 9.5]} for one in (name, "Floor")]
        truth["boxes"](String(json.dumps({"stamp": at, "objects": boxes})))
        mask_message = message(mask if name == "Now" else 0 * mask, "mono16")
        mask_message.header.stamp = rospy.Time.from_sec(at)
        truth["categories"](mask_message)
    truth["boxes"](String("no JSON"))
    grey = message(np.full((20, 30, 3), 100, np.uint8), "rgb8")
    grey.header.stamp = rospy.Time.from_sec(0.1)
    Subscriber.there["/drone/front"](grey)
    cameras.show()
    (said, content) = sent.pictures[-1]
    color = css_color(1)
    assert said["boxes"] == [{"name": "Now", "box": [4.5, 4.5, 9.5, 9.5], "color": color}]
    assert said["legend"] == [{"name": "Gate", "color": color}] and said["overlays"] == ["boxes", "mask"]
    painted = picture(content)[7, 7].astype(int), picture(content)[15, 25].astype(int)
    assert np.ptp(painted[0]) > 60 > 10 > np.ptp(painted[1])
    cameras.answer_overlay({"topic": "/drone/front", "overlay": "mask", "on": False})
    assert "/drone/front/truth/categories" not in Subscriber.there
    cameras.turn("/drone/front", False)
    assert not Subscriber.there


def test_a_picture_waits_for_its_boxes_for_a_limited_time(cameras, sent):
    cameras.rest(False)
    cameras.offer((ImageTopic("/drone/front", has_truth=True),))
    cameras.turn("/drone/front", True)
    cameras.answer_overlay({"topic": "/drone/front", "overlay": "boxes", "on": True})
    hear, truth = Subscriber.there["/drone/front"], Subscriber.there["/drone/front/truth/boxes"]

    def take(number):
        one = message(np.full((2, 2, 3), 10 * number, np.uint8), "rgb8")
        one.header.stamp = rospy.Time.from_sec(0.1 * number)
        hear(one)
        cameras.show()
        return [int(picture(content)[0, 0, 0]) // 10 for _, content in sent.pictures]

    assert take(1) == []
    truth(String(json.dumps({"stamp": 0.1, "objects": []})))
    assert take(2) == [1], "the boxes of the second picture have not arrived"
    for number in range(3, 9):
        assert take(number) == [1]
    assert take(9) == [1, 9]


def test_a_view_opened_by_a_script_switches_its_camera_on_and_off(cameras):
    cameras.rest(False)
    cameras.follow_views(frozenset({"/drone/depth/image", "/later"}))
    assert cameras.shown == ["/drone/depth/image"]
    cameras.offer((ImageTopic("/drone/depth/image"), ImageTopic("/later")))
    assert cameras.shown == ["/drone/depth/image", "/later"]
    cameras.turn("/drone/depth/image", False)
    cameras.follow_views(frozenset({"/drone/depth/image", "/later"}))
    assert cameras.shown == ["/later"], "closed by a person"
    cameras.follow_views(frozenset())
    assert cameras.shown == []
    cameras.turn("/later", True)
    cameras.offer(())
    assert cameras.shown == [] and not Subscriber.there


@pytest.mark.parametrize("wrong", ["nonsense", "[" * 100_000, "3", '{"views": 3}', '{"views": [], "dialogs": []}'])
def test_an_invalid_state_of_windows_is_ignored(cameras, sent, wrong):
    windows = ScriptWindows("/drone_sim", cameras, sent)
    view = {"handle": 1, "topic": "/drone/front", "label": "x"}
    windows._on_message(String(json.dumps({"views": [view, 7], "dialogs": [], "consoles": []})))
    windows._on_message(String(wrong))
    assert cameras.shown == ["/drone/front"]
    assert windows.answers["windows"]({}) == {
        "windows": {"views": [view], "dialogs": [], "consoles": []},
        "pictures": ["/drone/front"],
    }
    with pytest.raises(ValueError, match="no simulation"):
        windows.answers["answer"]({"handle": 1, "button": "ok"})


def test_a_dialog_answer_without_a_subscriber_is_refused(cameras, sent, monkeypatch):
    windows = ScriptWindows("/drone_sim", cameras, sent)
    publisher = windows._publisher = mock.Mock()
    publisher.get_num_connections.return_value = 0
    monkeypatch.setattr(cameras_module, "_CONNECT_TIMEOUT", 0.0)
    with pytest.raises(ValueError, match="press the button again"):
        windows.answers["answer"]({"handle": 1, "button": "ok"})
    publisher.publish.assert_not_called()
    publisher.get_num_connections.side_effect = [0, 1]
    monkeypatch.setattr(cameras_module, "_CONNECT_TIMEOUT", 60.0)
    windows.answers["answer"]({"handle": 1, "button": "ok", "typed": "2"})
    assert json.loads(publisher.publish.call_args.args[0]) == {"handle": 1, "button": "ok", "typed": "2"}


@pytest.mark.parametrize(
    "topic, vehicles, name",
    [
        ("/drone/front", ("drone",), "front"),
        ("/drone/track/image", ("drone",), "tracking"),
        ("/drone/depth/image", ("drone", "wing"), "drone, depth"),
        ("/drone_sim/views/Spy", ("drone",), "Spy"),
        ("/robot/eye", (), "robot/eye"),
    ],
)
def test_cameras_have_short_names(topic, vehicles, name):
    assert camera_name(topic, vehicles) == name


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"topic": "/drone/frond", "on": True}, "topic = '/drone/frond': does not exist; near names"),
        ({"topic": "/drone/front", "on": 1}, "on = 1: must be true or false"),
        ({"on": True}, "topic = None: "),
    ],
)
def test_an_invalid_camera_request_is_refused(cameras, wrong, said):
    with pytest.raises(ValueError, match=f"^{re.escape(said)}"):
        cameras.answer_camera(wrong)
    assert cameras.shown == []
    cameras.answer_camera({"topic": "/drone/front", "on": True})
    assert cameras.shown == ["/drone/front"]
