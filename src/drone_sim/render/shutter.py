"""Rolling shutter and motion blur: the exposure interval of each image row.

Row r of h is exposed for `exposure` s, centred at (r + 1/2 - h/2) / h · readout after the image's stamp: the stamp is
that of the middle row. A pixel's light is the mean over its row's exposure, computed from images rendered at moments
between which objects move by a pixel or two (P. Haeberli and K. Akeley, The Accumulation Buffer, SIGGRAPH 1990). At
each moment only the exposed rows are rendered, weighted by the share of the row's exposure that the moment represents.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.render.light import decoded

_MAX_MOMENTS = 64  # of an image; faster motion is rendered in larger steps
_STEP = 1.5  # px of motion between moments
_MIN_SHARE = 1e-6  # of a row's light


class Shutter(NamedTuple):
    """Exposure time of each row, and readout time from the first row to the last, s."""

    exposure: float
    readout: float

    def moments(self, height: int, speed: float) -> list[Exposed]:
        """Return the moments at which to render an image of `height` px whose content moves at `speed` px/s."""
        whole = self.exposure + self.readout
        step = max(_STEP / max(speed, 1e-9), whole / _MAX_MOMENTS)
        if whole < step / 2:
            return [Exposed(0.0, 0, np.ones(height))]
        exposed = max(self.exposure, step)  # of a row's exposure; moment k stands for the step centred at k · step
        middles = ((np.arange(height) + 0.5) / height - 0.5) * self.readout / step + 0.5
        begin, end = middles - exposed / step / 2, middles + exposed / step / 2
        moments = []
        for number in range(math.floor(begin[0]), math.ceil(end[-1])):
            shares = (np.clip(end, number, number + 1) - np.clip(begin, number, number + 1)) * step / exposed
            rows = np.flatnonzero(shares > _MIN_SHARE)
            if len(rows):
                moments.append(Exposed(number * step, int(rows[0]), shares[rows[0] : rows[-1] + 1]))
        return moments


class Exposed(NamedTuple):
    """A moment (s after the stamp), the first row exposed at it, and the share of its light that each row gets."""

    time: float
    first: int
    shares: np.ndarray


def gathered(
    moments: list[Exposed], size: tuple[int, int], draw: Callable[[float, int, int], np.ndarray]
) -> np.ndarray:
    """Return the linear light of an image of `size` (width, height), (height, width, 3) float32; white is 1.

    `draw(time, first, end)` returns the rows first to end - 1 (uint8 RGB), rendered `time` s after the stamp.
    """
    width, height = size
    if len(moments) == 1:
        return decoded(draw(0.0, 0, height))
    light = np.zeros((height, width * 3), np.float32)
    for time, first, shares in moments:
        end = first + len(shares)
        drawn = decoded(draw(time, first, end)).reshape(len(shares), -1)
        drawn *= shares[:, None].astype(np.float32)
        light[first:end] += drawn
    return light.reshape(height, width, 3)


def moved(poses: np.ndarray, velocities: np.ndarray, time: float) -> np.ndarray:
    """Return the poses (..., 4, 4) after `time` s at constant velocities (..., 6), linear (m/s) and angular (rad/s).

    Both velocities are in the world frame.
    """
    later = np.array(poses)
    later[..., :3, 3] += velocities[..., :3] * time
    for index in np.argwhere(velocities[..., 3:].any(axis=-1)):
        pose_index = tuple(index)
        later[pose_index][:3, :3] = cv2.Rodrigues(velocities[pose_index][3:] * time)[0] @ later[pose_index][:3, :3]
    return later
