"""What messages look like, and several of them in one picture."""

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

from sensor_msgs.msg import CompressedImage, Image

from drone_sim.ros.core.image_messages import image
from drone_sim.ros.tools import pictures

BLUE = np.full((4, 6, 3), (255, 0, 0), np.uint8)


@pytest.mark.parametrize(
    "message",
    [
        image(BLUE, "bgr8"),
        image(np.ascontiguousarray(BLUE[:, :, ::-1]), "rgb8"),
        CompressedImage(format="rgb8; png compressed bgr8", data=cv2.imencode(".png", BLUE)[1].tobytes()),
    ],
)
def test_colours_are_what_they_are(message):
    assert np.array_equal(pictures.decode(message), BLUE)


def test_grey_becomes_grey():
    grey = np.arange(24, dtype=np.uint8).reshape(4, 6)
    assert np.array_equal(pictures.decode(image(grey, "mono8")), np.repeat(grey[:, :, None], 3, axis=2))


def test_depth_is_the_darker_the_farther_and_black_without_any():
    metres = np.array([[0.0, 3.0, 100.0, np.nan, np.inf, -1.0]], np.float32)
    near, three, far, nothing, infinite, absurd = pictures.decode(image(metres, "32FC1"))[0, :, 0]
    assert (near, three, absurd) == (255, 127, 255)
    assert 0 < far < 10
    assert (nothing, infinite) == (0, 0)
    millimetres = np.array([[3000, 0]], np.uint16)
    assert pictures.decode(image(millimetres, "16UC1"))[0, :, 0].tolist() == [127, 0]


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (Image(encoding="rgb7", width=1, height=1, step=3, data=b"abc"), "encoding 'rgb7'"),
        (Image(encoding="rgb8", width=100, height=100, step=300, data=b"abc"), "encoding 'rgb8'"),
        (Image(encoding="32FC1", width=100, height=100, step=400, data=b"abcd"), "encoding '32FC1'"),
        (Image(encoding="rgb8"), "encoding 'rgb8'"),
        (CompressedImage(format="jpeg", data=b"no picture"), "not a picture: format 'jpeg'"),
        (CompressedImage(format="jpeg"), "not a picture"),
        (CompressedImage(format="32FC1; compressedDepth", data=b"x"), "compressedDepth is not shown"),
    ],
)
def test_what_cannot_be_shown_is_told_in_one_line(message, said):
    with pytest.raises(ValueError, match=said) as error:
        pictures.decode(message)
    assert "\n" not in str(error.value)


def test_pictures_stand_side_by_side_and_fit():
    red = np.full((8, 3, 3), (0, 0, 255), np.uint8)
    one = pictures.tile([("a", BLUE)])
    caption = one.shape[0] - 4
    assert one.shape[1] == 6
    assert np.array_equal(one[caption:], BLUE)
    three = pictures.tile([("a", BLUE), ("b", red), ("c", BLUE)])
    assert three.shape == (2 * (caption + 8), 12, 3)
    assert np.array_equal(three[caption + 2 : caption + 6, :6], BLUE)
    assert np.count_nonzero((three == (0, 0, 255)).all(axis=2)) == red[:, :, 0].size
    assert not three[caption + 8 :, 6:].any()
    small = pictures.tile([("a", np.zeros((100, 1000, 3), np.uint8))], largest=(200, 200))
    assert small.shape[1] == 200
    assert small.shape[0] <= 200
