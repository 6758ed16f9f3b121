"""A camera's pictures as OpenCV has them, for people to look at."""

from __future__ import annotations

import cv2
import numpy as np

_HALF = 3.0  # m, at which depth is shown half as bright as right in front


def to_color(picture: np.ndarray) -> np.ndarray:
    """Return a camera's picture, RGB or depth (m), as BGR; depth is the darker the farther, black where it is none."""
    if picture.ndim == 3:
        return cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return depth_to_grey(picture)


def depth_to_grey(depth: np.ndarray) -> np.ndarray:
    """Return depth (height, width) in m as a grey picture, BGR: the darker the farther, black where there is none."""
    with np.errstate(invalid="ignore"):
        grey = 255 / (1 + np.maximum(np.nan_to_num(depth.astype(float), nan=np.inf), 0) / _HALF)
    return cv2.cvtColor(grey.astype(np.uint8), cv2.COLOR_GRAY2BGR)
