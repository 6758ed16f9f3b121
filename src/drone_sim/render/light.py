"""Conversion between sRGB pixel values and linear light (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

_STEPS = 65535  # of light between black and white, enough for every pixel value to survive decoding and encoding


def _to_light(value: np.ndarray) -> np.ndarray:
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _to_value(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


_LIGHTS = _to_light(np.arange(256) / 255).astype(np.float32)
_VALUES = np.rint(255 * _to_value(np.arange(_STEPS + 1) / _STEPS)).astype(np.uint8)


def decoded(image: np.ndarray, share: float = 1.0) -> np.ndarray:
    """Return the linear light of an image (height, width, 3) uint8, times `share`, as float32; white is 1."""
    return np.asarray(cv2.LUT(image, _LIGHTS * np.float32(share)))


def encoded(light: np.ndarray) -> np.ndarray:
    """Return the image (height, width, 3) uint8 of linear light, clipped at black and white."""
    steps: Any = cv2.addWeighted(light, _STEPS, light, 0.0, 0.0, dtype=cv2.CV_16U)  # saturates
    return np.take(_VALUES, steps)
