"""The colors of masks: one for each number, and a picture with its mask over it."""

from __future__ import annotations

import colorsys

import numpy as np

_GOLDEN = 0.618034  # of the circle of hues: no two numbers in a row look alike
_SHARE = 0.55  # of the mask's color in a pixel


def color_of(number: int) -> tuple[float, float, float]:
    """Return the color of a number: red, green, blue, 0 to 1."""
    return colorsys.hsv_to_rgb(number * _GOLDEN % 1.0, 0.75, 1.0)


def painted(picture: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return a picture (height, width, 3) uint8 RGB with the colors of a mask's numbers (height, width) over it.

    Where the mask is 0, the picture is as it was.
    """
    colors = np.array([color_of(number) for number in range(int(mask.max(initial=0)) + 1)], np.float32)
    over, there = np.array(picture), mask > 0
    over[there] = (1 - _SHARE) * over[there] + _SHARE * 255 * colors[mask[there]]
    return over
