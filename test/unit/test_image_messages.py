"""Images read as cv_bridge reads them, whoever has sent them."""

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


def sent(encoding, margin=0):
    """Return an image of noise, each row with some bytes more than its pixels."""
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    picture = np.random.RandomState(1).randint(0, 120, (HEIGHT, WIDTH, channels)).astype(kind)
    rows = [row.tobytes() + bytes(margin) for row in picture]
    return Image(height=HEIGHT, width=WIDTH, encoding=encoding, step=len(rows[0]), data=b"".join(rows))


@pytest.mark.parametrize("encoding", [*COLORS, *NUMBERS, "yuv422"])
@pytest.mark.parametrize("margin", [0, 8])  # which Debian 12's cv_bridge takes for pixels
def test_pixels_are_those_of_cv_bridge(encoding, margin):
    ours, theirs = image_messages.pixels(sent(encoding, margin)), BRIDGE.imgmsg_to_cv2(sent(encoding))
    assert ours.dtype == theirs.dtype
    assert np.array_equal(ours, theirs)


@pytest.mark.parametrize(
    "encoding", [one for one in COLORS if "16" not in one or not one.startswith("bayer")] + ["yuv422"]
)
def test_colors_are_those_of_cv_bridge(encoding):
    message = sent(encoding)
    ours, theirs = image_messages.bgr(message).astype(int), BRIDGE.imgmsg_to_cv2(message, "bgr8").astype(int)
    assert np.abs(ours - theirs).max() <= (1 if encoding.endswith("16") else 0)  # rounded otherwise


@pytest.mark.parametrize("encoding", ["bgr8", "rgba8", "mono8", "mono16", "32FC1", "16UC1", "32FC3"])
def test_cv_bridge_reads_what_is_sent(encoding):
    kind, channels = BRIDGE.encoding_to_dtype_with_channels(encoding)
    shape = (HEIGHT, WIDTH) if channels == 1 else (HEIGHT, WIDTH, channels)
    picture = np.arange(np.prod(shape)).reshape(shape).astype(kind)
    assert np.array_equal(BRIDGE.imgmsg_to_cv2(image_messages.image(picture, encoding)), picture)


def test_numbers_may_come_from_a_big_endian_machine():
    depths = np.array([[1.5, np.nan]], np.float32)
    message = Image(height=1, width=2, encoding="32FC1", step=8, is_bigendian=1, data=depths.astype(">f4").tobytes())
    found = image_messages.pixels(message)
    assert found.dtype == np.dtype("f4") and np.array_equal(found, depths, equal_nan=True)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"encoding": "rgb7"}, "is unknown"),
        ({"encoding": "8UC0"}, "is unknown"),
        ({"encoding": ""}, "is unknown"),
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
    with pytest.raises(ValueError, match="must be colors or gray"):
        image_messages.bgr(sent("32FC1"))
