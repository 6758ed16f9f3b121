"""Pictures for a browser: JPEGs as they come, colours packed, depths in colours with what these mean."""

from __future__ import annotations

import math

import cv2
import numpy as np
from cv_bridge import CvBridge, CvBridgeError
from sensor_msgs.msg import CompressedImage, Image

_WIDEST, _WIDEST_DEPTHS = 640, 320  # px; of a larger one, every other pixel, or less, is shown
_COLORS = cv2.COLORMAP_TURBO  # near is blue, far is red
_JPEG = (cv2.IMWRITE_JPEG_QUALITY, 80)
_MILLIMETRES = "16UC1"  # REP-118
_bridge = CvBridge()


def packed(message: CompressedImage | Image) -> tuple[bytes, str]:
    """Return a picture as a browser shows it, and a caption. Raises ValueError for one of an unknown kind."""
    if isinstance(message, CompressedImage):
        return bytes(message.data), ""
    try:
        image = _bridge.imgmsg_to_cv2(message)
    except (CvBridgeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"encoding '{message.encoding[:40]}': {error}") from None
    if not image.size:
        raise ValueError("has no pixels")
    is_depth = image.ndim == 2 and image.dtype != np.uint8
    step = -(-image.shape[1] // (_WIDEST_DEPTHS if is_depth else _WIDEST))
    image = image[::step, ::step]
    if is_depth:
        return _depths(image.astype(np.float32) * (1e-3 if message.encoding == _MILLIMETRES else 1.0))
    return _encoded(_as_bgr(image, message.encoding)), ""


def _depths(depths: np.ndarray) -> tuple[bytes, str]:
    """Return depths (m) in colours, black where there is none, and the range of these."""
    there = np.isfinite(depths) & (depths > 0)
    if not there.any():
        return _encoded(np.zeros((*depths.shape, 3), np.uint8)), "nothing within its range"
    near, far = float(depths[there].min()), float(depths[there].max())
    share = np.log(np.where(there, depths, near) / near) / max(math.log(far / near), 1e-6)  # as eyes see distances
    scaled = (255 * share).astype(np.uint8)
    colored = cv2.applyColorMap(scaled, _COLORS)
    colored[~there] = 0
    return _encoded(colored), f"{near:.2f} m (blue) to {far:.2f} m (red)"


def _as_bgr(image: np.ndarray, encoding: str) -> np.ndarray:
    if image.dtype != np.uint8:
        raise ValueError(f"encoding '{encoding[:40]}' is none of colours with 8 bits, grey, or depth")
    if image.ndim == 3 and image.shape[2] in (3, 4) and encoding.startswith("rgb"):
        return np.ascontiguousarray(image[:, :, 2::-1])
    return np.ascontiguousarray(image[:, :, :3] if image.ndim == 3 else image)


def _encoded(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".jpg", image, _JPEG)[1])
