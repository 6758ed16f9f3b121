"""Conversion between arrays and image messages of every encoding, also where cv_bridge is wrong."""

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cv_bridge import CvBridge
from sensor_msgs.msg import CompressedImage, Image

from drone_sim.ros.core import image_messages
from drone_sim.ros.core.image_messages import image
from drone_sim.ros.tools import pictures

BRIDGE = CvBridge()
PATTERNS = ("bayer_rggb", "bayer_bggr", "bayer_gbrg", "bayer_grbg")
COLORS = [f"{name}{bits}" for name in ("bgr", "rgb", "bgra", "rgba", "mono", *PATTERNS) for bits in (8, 16)]
NUMBERS = [
    f"{kind}C{channels}" for kind in ("8U", "8S", "16U", "16S", "32S", "32F", "64F") for channels in (1, 2, 3, 4)
]
HEIGHT, WIDTH = 6, 8


def noise(encoding):
    """Return a random image of the encoding's type, (height, width, channels)."""
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    return np.random.RandomState(1).randint(0, 120, (HEIGHT, WIDTH, channels)).astype(kind)


def encode(encoding, margin=0):
    """Return an image message of noise, with `margin` padding bytes at the end of each row."""
    picture = noise(encoding)
    rows = [row.tobytes() + bytes(margin) for row in picture]
    return Image(height=HEIGHT, width=WIDTH, encoding=encoding, step=len(rows[0]), data=b"".join(rows))


@pytest.mark.parametrize("encoding", [*COLORS, *NUMBERS, "yuv422"])
@pytest.mark.parametrize("margin", [0, 8])  # cv_bridge 1.16 takes padding for pixels
def test_decoded_pixels_equal_the_sent_pixels(encoding, margin):
    found, picture = image_messages.pixels(encode(encoding, margin)), noise(encoding)
    assert found.dtype == picture.dtype
    assert np.array_equal(found, picture[:, :, 0] if picture.shape[2] == 1 else picture)


@pytest.mark.parametrize(
    "encoding", [one for one in COLORS if "16" not in one or not one.startswith("bayer")] + ["yuv422"]
)
def test_bgr_colors_equal_those_of_cv_bridge(encoding):
    ours, theirs = image_messages.bgr(encode(encoding, margin=8)), BRIDGE.imgmsg_to_cv2(encode(encoding), "bgr8")
    assert ours.shape == (HEIGHT, WIDTH, 3) and np.array_equal(ours, theirs)


@pytest.mark.parametrize("encoding, named", [("8UC1", "mono8"), ("8UC3", "bgr8"), ("8UC4", "bgra8")])
def test_encodings_without_colors_are_read_in_opencv_order(encoding, named):
    assert np.array_equal(image_messages.bgr(encode(encoding)), image_messages.bgr(encode(named)))


@pytest.mark.parametrize("encoding", ["bgr8", "rgba8", "mono8", "mono16", "32FC1", "16UC1", "32FC3"])
def test_cv_bridge_can_read_the_messages(encoding):
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    shape = (HEIGHT, WIDTH) if channels == 1 else (HEIGHT, WIDTH, channels)
    picture = np.arange(np.prod(shape)).reshape(shape).astype(kind)
    assert np.array_equal(BRIDGE.imgmsg_to_cv2(image_messages.image(picture, encoding)), picture)


def test_an_array_whose_type_differs_from_the_encoding_is_refused():
    with pytest.raises(TypeError, match="rgb8"):
        image_messages.image(np.zeros((HEIGHT, WIDTH), np.float32), "rgb8")


def test_big_endian_images_are_decoded():
    depths = np.array([[1.5, np.nan]], np.float32)
    message = Image(height=1, width=2, encoding="32FC1", step=8, is_bigendian=1, data=depths.astype(">f4").tobytes())
    found = image_messages.pixels(message)
    assert found.dtype == np.dtype("f4") and np.array_equal(found, depths, equal_nan=True)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"encoding": "rgb7"}, r"\[rgb7\]"),
        ({"encoding": "8UC0"}, "are too few"),
        ({"encoding": ""}, r"encoding \[\]"),
        ({"encoding": "rgb\udc80"}, "surrogates"),
        ({"height": HEIGHT + 1}, "8 x 7, step 24: 144 bytes are too few"),
        ({"step": 23}, "8 x 6, step 23: 144 bytes are too few"),
        ({"height": 4_000_000_000, "width": 4_000_000_000, "step": 4_000_000_000}, "are too few"),
        ({"width": 0}, "has no pixels"),
        ({"height": 0}, "has no pixels"),
    ],
)
def test_an_invalid_image_message_raises_an_error(changes, said):
    message = encode("bgr8")
    for key, value in changes.items():
        setattr(message, key, value)
    with pytest.raises(ValueError, match=said):
        image_messages.pixels(message)


def test_bgr_of_a_depth_image_raises_an_error():
    with pytest.raises(ValueError, match="is not a color format"):
        image_messages.bgr(encode("32FC1"))


# ---- decoding messages for display


BLUE = np.full((4, 6, 3), (255, 0, 0), np.uint8)


@pytest.mark.parametrize(
    "message",
    [
        image(BLUE, "bgr8"),
        image(np.ascontiguousarray(BLUE[:, :, ::-1]), "rgb8"),
        CompressedImage(format="rgb8; png compressed bgr8", data=cv2.imencode(".png", BLUE)[1].tobytes()),
    ],
)
def test_raw_and_compressed_color_images_are_decoded(message):
    assert np.array_equal(pictures.decode(message), BLUE)


def test_a_mono_image_is_decoded_to_grey():
    grey = np.arange(24, dtype=np.uint8).reshape(4, 6)
    assert np.array_equal(pictures.decode(image(grey, "mono8")), np.repeat(grey[:, :, None], 3, axis=2))


def test_far_depths_are_darker_and_missing_depths_are_black():
    metres = np.array([[0.0, 3.0, 100.0, np.nan, np.inf, -1.0]], np.float32)
    near, three, far, nothing, infinite, negative = pictures.decode(image(metres, "32FC1"))[0, :, 0]
    assert (near, three, negative) == (255, 127, 255)
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
def test_an_image_that_cannot_be_shown_raises_a_one_line_error(message, said):
    with pytest.raises(ValueError, match=said) as error:
        pictures.decode(message)
    assert "\n" not in str(error.value)


def test_images_are_tiled_side_by_side_within_the_size_limit():
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
