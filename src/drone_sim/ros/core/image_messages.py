"""Pictures as sensor_msgs/Image, and back.

cv_bridge does the same. It is not used, for it needs OpenCV's C++ libraries, and with them VTK, GDAL and FFmpeg: half a
gigabyte on a first start.
"""

from __future__ import annotations

import re
import sys

import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header

# Of sensor_msgs/image_encodings.h: the number of channels, and what OpenCV calls the conversion to BGR.
_COLORS: dict[str, tuple[int, str]] = {
    "bgr": (3, ""),
    "rgb": (3, "RGB2BGR"),
    "bgra": (4, "BGRA2BGR"),
    "rgba": (4, "RGBA2BGR"),
    "mono": (1, "GRAY2BGR"),
    # OpenCV names a pattern by its second row, ROS by its first.
    "bayer_rggb": (1, "BayerBG2BGR"),
    "bayer_bggr": (1, "BayerRG2BGR"),
    "bayer_gbrg": (1, "BayerGR2BGR"),
    "bayer_grbg": (1, "BayerGB2BGR"),
}
_YUV = {"yuv422": "YUV2BGR_UYVY", "yuv422_yuy2": "YUV2BGR_YUY2"}  # 2 channels of 8 bits
_COLOR = re.compile(rf"({'|'.join(_COLORS)})(8|16)")
_NUMBERS = re.compile(r"(8U|8S|16U|16S|32S|32F|64F)C([1-9]\d?)")
_KINDS = {"U": "u", "S": "i", "F": "f"}


def image(picture: np.ndarray, encoding: str, header: Header | None = None) -> Image:
    """Return a picture (height, width) or (height, width, channels), of the type that `encoding` says."""
    height, width = picture.shape[:2]
    is_big = sys.byteorder == "big"
    return Image(header or Header(), height, width, encoding, is_big, picture[0].nbytes, picture.tobytes())


def pixels(message: Image) -> np.ndarray:
    """Return what is in an image, (height, width) or (height, width, channels), of the type that its encoding says.

    It cannot be written to. Raises ValueError, in one line, for an unknown encoding, and for fewer bytes than it says.
    """
    kind, channels = _layout(message.encoding)
    kind = kind.newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = message.height, message.width, message.step
    row = width * channels * kind.itemsize
    if not row or not height:
        raise ValueError(f"{width} x {height}: has no pixels")
    if step < row or len(message.data) < step * (height - 1) + row:
        raise ValueError(f"{width} x {height}, step {step}: {len(message.data)} bytes are too few")
    shape, strides = (height, width, channels), (step, channels * kind.itemsize, kind.itemsize)
    found: np.ndarray = np.ndarray(shape, kind, bytes(message.data), strides=strides)
    return (found[:, :, 0] if channels == 1 else found).astype(kind.newbyteorder("="), copy=False)


def bgr(message: Image) -> np.ndarray:
    """Return a color or gray image as BGR with 8 bits, (height, width, 3). Raises ValueError for any other."""
    return to_bgr(pixels(message), message.encoding)


def to_bgr(picture: np.ndarray, encoding: str) -> np.ndarray:
    """Return what `pixels` has found as BGR with 8 bits, (height, width, 3). Raises ValueError for what is no color."""
    import cv2  # which takes its time, and the node needs none

    found = np.ascontiguousarray(picture)
    if encoding in _YUV:
        return cv2.cvtColor(found, getattr(cv2, f"COLOR_{_YUV[encoding]}"))
    color = _COLOR.fullmatch(encoding)
    if color is None:
        raise ValueError("must be colors or gray, such as rgb8, yuv422, bayer_rggb8 or mono8")
    if found.dtype != np.uint8:
        found = cv2.convertScaleAbs(found, alpha=255.0 / 65535.0)
    conversion = _COLORS[color[1]][1]
    return cv2.cvtColor(found, getattr(cv2, f"COLOR_{conversion}")) if conversion else found


def _layout(encoding: str) -> tuple[np.dtype, int]:
    """Return the type of a number, and how many there are for a pixel."""
    color, numbers = _COLOR.fullmatch(encoding), _NUMBERS.fullmatch(encoding)
    if color:
        return np.dtype(f"u{int(color[2]) // 8}"), _COLORS[color[1]][0]
    if numbers:
        return np.dtype(f"{_KINDS[numbers[1][-1]]}{int(numbers[1][:-1]) // 8}"), int(numbers[2])
    if encoding in _YUV:
        return np.dtype(np.uint8), 2
    raise ValueError("is unknown")
