"""When the rows of a picture are exposed: a rolling shutter, and motion blur.

Row r of h is exposed for `exposure` s, the middle of which is (r + 1/2 - h/2) / h · readout after the picture's stamp:
so the stamp is in the middle of the picture. A pixel's light is the mean over its row's exposure; it is computed of
pictures at moments between which little moves, a pixel or two (P. Haeberli and K. Akeley, The Accumulation Buffer,
SIGGRAPH 1990). Each is drawn in the rows alone that are exposed then, and counts by how much of a row's exposure it
stands for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.render.light import decoded

_MOST = 64  # moments of a picture; what moves faster is drawn in larger steps
_STEP = 1.5  # px, from moment to moment
_LEAST = 1e-6  # of a row's light


class Shutter(NamedTuple):
    """How long each row is exposed, and how long it takes from the first row to the last, s."""

    exposure: float
    readout: float

    def moments(self, height: int, speed: float) -> list[Exposed]:
        """Return the moments at which a picture of that height (px) is drawn, where it moves at `speed` (px/s)."""
        whole = self.exposure + self.readout
        step = max(_STEP / max(speed, 1e-9), whole / _MOST)
        if whole < step / 2:
            return [Exposed(0.0, 0, np.ones(height))]
        wide = max(self.exposure, step)  # of a row's exposure; the moment number k is that of the step around k · step
        middles = ((np.arange(height) + 0.5) / height - 0.5) * self.readout / step + 0.5
        begin, end = middles - wide / step / 2, middles + wide / step / 2
        moments = []
        for number in range(math.floor(begin[0]), math.ceil(end[-1])):
            shares = (np.clip(end, number, number + 1) - np.clip(begin, number, number + 1)) * step / wide
            rows = np.flatnonzero(shares > _LEAST)
            if len(rows):
                moments.append(Exposed(number * step, int(rows[0]), shares[rows[0] : rows[-1] + 1]))
        return moments


class Exposed(NamedTuple):
    """A moment, s after the stamp; the first row that is exposed then; how much of its light each row gets then."""

    time: float
    first: int
    shares: np.ndarray


def gathered(
    moments: list[Exposed], size: tuple[int, int], draw: Callable[[float, int, int], np.ndarray]
) -> np.ndarray:
    """Return the light of a picture of some width and height, (height, width, 3) float32; white is 1.

    `draw` returns rows of the picture (uint8 RGB) at a time after the stamp, from the first to the one before the end.
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
    """Return poses (..., 4, 4) as they are after some time (s), each going on with its velocities (..., 6).

    These are of the origin (m/s), and of the turn (rad/s), in the world.
    """
    later = np.array(poses)
    later[..., :3, 3] += velocities[..., :3] * time
    for place in np.argwhere(velocities[..., 3:].any(axis=-1)):
        here = tuple(place)
        later[here][:3, :3] = cv2.Rodrigues(velocities[here][3:] * time)[0] @ later[here][:3, :3]
    return later
