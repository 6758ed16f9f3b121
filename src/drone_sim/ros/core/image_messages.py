"""Conversion between images and sensor_msgs/Image by cv_bridge, with checks that cv_bridge lacks; drawing of masks."""

from __future__ import annotations

import colorsys
import sys

import numpy as np
from cv_bridge import CvBridge, CvBridgeError
from sensor_msgs.msg import Image
from std_msgs.msg import Header

_BRIDGE = CvBridge()
_COLORS = {"8UC1": "mono8", "8UC3": "bgr8", "8UC4": "bgra8"}  # these encodings name no colors: OpenCV's order is used
_HUE_STEP = 0.618034  # golden ratio: consecutive numbers get very different hues
_MASK_OPACITY = 0.55


def image(picture: np.ndarray, encoding: str, header: Header | None = None) -> Image:
    """Return the message of a picture (height, width) or (height, width, channels), which has the encoding's type."""
    return _BRIDGE.cv2_to_imgmsg(picture, encoding, header)


def pixels(message: Image) -> np.ndarray:
    """Return the pixels of a message, (height, width) or (height, width, channels), of its encoding's type.

    The array may be read-only. Raises ValueError, in one line, for an unknown encoding, and for fewer bytes than the
    message needs.
    """
    return _convert(message, message.encoding, "passthrough")


def bgr(message: Image) -> np.ndarray:
    """Return a color or gray image as BGR with 8 bits, (height, width, 3). Raises ValueError for any other encoding."""
    return _convert(message, _COLORS.get(message.encoding, message.encoding), "bgr8")


def _convert(message: Image, encoding: str, target: str) -> np.ndarray:
    try:
        return _BRIDGE.imgmsg_to_cv2(_normalize(message, encoding), target)
    except CvBridgeError as error:
        raise ValueError(" ".join(str(error).split())) from None


def _normalize(message: Image, encoding: str) -> Image:
    """Return the image as `encoding`, in this machine's byte order, without padding between its rows.

    cv_bridge 1.16 ignores `step`, so it would read the padding as pixels. Its conversion of the byte order fails with
    numpy 2. It does not check the number of bytes.
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


# ---- masks


def mask_color(number: int) -> tuple[float, float, float]:
    """Return the color of a number in masks: red, green, blue, 0 to 1."""
    return colorsys.hsv_to_rgb(number * _HUE_STEP % 1.0, 0.75, 1.0)


def draw_mask(picture: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return a picture (height, width, 3) uint8 RGB, tinted with the colors of a mask (height, width).

    Pixels where the mask is 0 stay unchanged.
    """
    colors = np.array([mask_color(number) for number in range(int(mask.max(initial=0)) + 1)], np.float32)
    result, is_masked = np.array(picture), mask > 0
    result[is_masked] = (1 - _MASK_OPACITY) * result[is_masked] + _MASK_OPACITY * 255 * colors[mask[is_masked]]
    return result
