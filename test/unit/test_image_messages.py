"""Pictures of every encoding as messages and back, and what cv_bridge alone would read wrongly."""

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cv_bridge import CvBridge
from sensor_msgs.msg import Image

from drone_sim.ros.core import image_messages

BRIDGE = CvBridge()
PATTERNS = ("bayer_rggb", "bayer_bggr", "bayer_gbrg", "bayer_grbg")
COLORS = [f"{name}{bits}" for name in ("bgr", "rgb", "bgra", "rgba", "mono", *PATTERNS) for bits in (8, 16)]
NUMBERS = [
    f"{kind}C{channels}" for kind in ("8U", "8S", "16U", "16S", "32S", "32F", "64F") for channels in (1, 2, 3, 4)
]
HEIGHT, WIDTH = 6, 8


def noise(encoding):
    """Return random numbers of an encoding's type, (height, width, channels)."""
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    return np.random.RandomState(1).randint(0, 120, (HEIGHT, WIDTH, channels)).astype(kind)


def sent(encoding, margin=0):
    """Return a picture of noise as a message, with `margin` bytes after the pixels of each row."""
    picture = noise(encoding)
    rows = [row.tobytes() + bytes(margin) for row in picture]
    return Image(height=HEIGHT, width=WIDTH, encoding=encoding, step=len(rows[0]), data=b"".join(rows))


@pytest.mark.parametrize("encoding", [*COLORS, *NUMBERS, "yuv422"])
@pytest.mark.parametrize("margin", [0, 8])  # which cv_bridge 1.16 takes for pixels
def test_pixels_are_those_that_were_sent(encoding, margin):
    found, picture = image_messages.pixels(sent(encoding, margin)), noise(encoding)
    assert found.dtype == picture.dtype
    assert np.array_equal(found, picture[:, :, 0] if picture.shape[2] == 1 else picture)


@pytest.mark.parametrize(
    "encoding", [one for one in COLORS if "16" not in one or not one.startswith("bayer")] + ["yuv422"]
)
def test_colors_are_those_of_cv_bridge(encoding):
    ours, theirs = image_messages.bgr(sent(encoding, margin=8)), BRIDGE.imgmsg_to_cv2(sent(encoding), "bgr8")
    assert ours.shape == (HEIGHT, WIDTH, 3) and np.array_equal(ours, theirs)


@pytest.mark.parametrize("encoding, named", [("8UC1", "mono8"), ("8UC3", "bgr8"), ("8UC4", "bgra8")])
def test_bytes_without_a_color_are_in_opencvs_order(encoding, named):
    assert np.array_equal(image_messages.bgr(sent(encoding)), image_messages.bgr(sent(named)))


@pytest.mark.parametrize("encoding", ["bgr8", "rgba8", "mono8", "mono16", "32FC1", "16UC1", "32FC3"])
def test_cv_bridge_reads_what_is_sent(encoding):
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    shape = (HEIGHT, WIDTH) if channels == 1 else (HEIGHT, WIDTH, channels)
    picture = np.arange(np.prod(shape)).reshape(shape).astype(kind)
    assert np.array_equal(BRIDGE.imgmsg_to_cv2(image_messages.image(picture, encoding)), picture)


def test_a_picture_of_another_type_than_its_encoding_is_not_sent():
    with pytest.raises(TypeError, match="rgb8"):
        image_messages.image(np.zeros((HEIGHT, WIDTH), np.float32), "rgb8")


def test_numbers_may_come_from_a_big_endian_machine():
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
def test_what_cannot_be_read_is_said_in_one_line(changes, said):
    message = sent("bgr8")
    for key, value in changes.items():
        setattr(message, key, value)
    with pytest.raises(ValueError, match=said):
        image_messages.pixels(message)


def test_what_is_no_color_is_said():
    with pytest.raises(ValueError, match="is not a color format"):
        image_messages.bgr(sent("32FC1"))
