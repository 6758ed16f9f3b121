"""Conversion of pictures for browsers. Only imported when needed, because OpenCV and cv_bridge are slow imports."""

from __future__ import annotations

import math

import cv2
import numpy as np
from sensor_msgs.msg import Image

from drone_sim.ros.core import image_messages

_COLORS = cv2.COLORMAP_TURBO  # near is blue, far is red
_JPEG = (cv2.IMWRITE_JPEG_QUALITY, 80)
_MILLIMETRES = "16UC1"  # REP-118


def as_jpeg(message: Image, step: int) -> tuple[bytes, str]:
    """Return every `step`-th pixel of an image as JPEG, and a caption. Raises ValueError for unknown encodings."""
    try:
        image = image_messages.pixels(message)
        if image.ndim == 2 and image.dtype != np.uint8:
            depths = image[::step, ::step].astype(np.float32)
            return _encode_depths(depths * (1e-3 if message.encoding == _MILLIMETRES else 1.0))
        return _jpeg(image_messages.bgr(message)[::step, ::step]), ""
    except ValueError as error:
        raise ValueError(f"encoding '{message.encoding[:40]}': {error}") from None


def _encode_depths(depths: np.ndarray) -> tuple[bytes, str]:
    """Return depths (m) in colors on a logarithmic scale, black for unknown ones, and a caption with the range."""
    is_known = np.isfinite(depths) & (depths > 0)
    if not is_known.any():
        return _jpeg(np.zeros((*depths.shape, 3), np.uint8)), "nothing within range"
    near, far = float(depths[is_known].min()), float(depths[is_known].max())
    share = np.log(np.where(is_known, depths, near) / near) / max(math.log(far / near), 1e-6)
    scaled = (255 * share).astype(np.uint8)
    colored = cv2.applyColorMap(scaled, _COLORS)
    colored[~is_known] = 0
    return _jpeg(colored), f"{near:.2f} m (blue) to {far:.2f} m (red)"


def _jpeg(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".jpg", image, _JPEG)[1])


def with_mask(picture: bytes, message: Image) -> tuple[bytes, list[int]]:
    """Return a picture (JPEG or PNG) with a mask over it as JPEG, and the numbers in the mask.

    A picture that cannot be decoded is returned unchanged. Raises ValueError for an unknown encoding of the mask.
    """
    mask = image_messages.pixels(message)
    numbers = np.unique(mask).tolist()
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        return picture, numbers
    mask = cv2.resize(mask, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    masked = image_messages.draw_mask(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), mask)
    return bytes(cv2.imencode(".jpg", cv2.cvtColor(masked, cv2.COLOR_RGB2BGR))[1]), numbers


def css_color(number: int) -> str:
    """Return the CSS color of a category's number."""
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in image_messages.mask_color(number))
