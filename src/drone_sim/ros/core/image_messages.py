"""Conversion between pictures and sensor_msgs/Image by cv_bridge, with the checks that cv_bridge lacks."""

from __future__ import annotations

import sys

import numpy as np
from cv_bridge import CvBridge, CvBridgeError
from sensor_msgs.msg import Image
from std_msgs.msg import Header

_BRIDGE = CvBridge()
_COLORS = {"8UC1": "mono8", "8UC3": "bgr8", "8UC4": "bgra8"}  # these name no colors: OpenCV's order


def image(picture: np.ndarray, encoding: str, header: Header | None = None) -> Image:
    """Return a picture (height, width) or (height, width, channels), of the type of `encoding`, as a message."""
    return _BRIDGE.cv2_to_imgmsg(picture, encoding, header)


def pixels(message: Image) -> np.ndarray:
    """Return the pixels of a message, (height, width) or (height, width, channels), of the type of its encoding.

    The array may be read-only. Raises ValueError, in one line, for an unknown encoding, and for fewer bytes than the
    message needs.
    """
    return _read(message, message.encoding, "passthrough")


def bgr(message: Image) -> np.ndarray:
    """Return a color or gray image as BGR with 8 bits, (height, width, 3). Raises ValueError for any other."""
    return _read(message, _COLORS.get(message.encoding, message.encoding), "bgr8")


def _read(message: Image, encoding: str, wanted: str) -> np.ndarray:
    try:
        return _BRIDGE.imgmsg_to_cv2(_checked(message, encoding), wanted)
    except CvBridgeError as error:
        raise ValueError(" ".join(str(error).split())) from None


def _checked(message: Image, encoding: str) -> Image:
    """Return the image as `encoding`, in this machine's byte order, without bytes between its rows.

    cv_bridge 1.16 ignores `step`, so it would read the bytes after each row as pixels. Its conversion of the byte order
    fails with numpy 2. It does not check the number of bytes.
    """
    name, channels = _BRIDGE.encoding_to_dtype_with_channels(encoding)
    kind = np.dtype(name).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step, data = message.height, message.width, message.step, message.data
    row = width * channels * kind.itemsize
    if not row or not height:
        raise ValueError(f"{width} x {height}: has no pixels")
    if step < row or len(data) < step * (height - 1) + row:
        raise ValueError(f"{width} x {height}, step {step}: {len(data)} bytes are too few")
    if step != row or not kind.isnative:
        numbers: np.ndarray = np.ndarray((height, width * channels), kind, data, strides=(step, kind.itemsize))
        data = np.ascontiguousarray(numbers, kind.newbyteorder("="))
    return Image(message.header, height, width, encoding, sys.byteorder == "big", row, data)
