"""Pictures as light: how much of it a pixel's value stands for, by the sRGB curve (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

_STEPS = 65535  # of light between black and white, many enough that every value comes back as it was


def _light(value: np.ndarray) -> np.ndarray:
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _value(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


_LIGHTS = _light(np.arange(256) / 255).astype(np.float32)
_VALUES = np.rint(255 * _value(np.arange(_STEPS + 1) / _STEPS)).astype(np.uint8)


def decoded(picture: np.ndarray, share: float = 1.0) -> np.ndarray:
    """Return the light of a picture (height, width, 3) uint8, or a share of it, as float32; white is 1."""
    return np.asarray(cv2.LUT(picture, _LIGHTS * np.float32(share)))


def encoded(light: np.ndarray) -> np.ndarray:
    """Return the picture (height, width, 3) uint8 of light, which is cut off at black and at white."""
    steps: Any = cv2.addWeighted(light, _STEPS, light, 0.0, 0.0, dtype=cv2.CV_16U)  # which cuts it off
    return np.take(_VALUES, steps)
