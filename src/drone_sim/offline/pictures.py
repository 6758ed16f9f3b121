"""Conversion of camera images to BGR for display."""

from __future__ import annotations

import cv2
import numpy as np

_HALF_BRIGHTNESS_DEPTH = 3.0  # m, depth that is shown at half brightness


def to_color(picture: np.ndarray) -> np.ndarray:
    """Return a camera's image, RGB or depth (m), as BGR; greater depth is darker, unknown depth is black."""
    if picture.ndim == 3:
        return cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return depth_to_grey(picture)


def depth_to_grey(depth: np.ndarray) -> np.ndarray:
    """Return depth (height, width) in m as a grey BGR image; greater depth is darker, unknown depth is black."""
    with np.errstate(invalid="ignore"):
        grey = 255 / (1 + np.maximum(np.nan_to_num(depth.astype(float), nan=np.inf), 0) / _HALF_BRIGHTNESS_DEPTH)
    return cv2.cvtColor(grey.astype(np.uint8), cv2.COLOR_GRAY2BGR)
