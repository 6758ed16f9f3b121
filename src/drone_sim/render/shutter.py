"""When the rows of a picture are exposed: a rolling shutter, and motion blur.

Row r of h is exposed for `exposure` s, the middle of which is (r + 1/2 - h/2) / h · readout after the picture's stamp:
so the stamp is in the middle of the picture. A pixel's light is the mean over its row's exposure; it is
computed of pictures at moments between which little moves, a pixel or two (P. Haeberli and K. Akeley, The Accumulation
Buffer, SIGGRAPH 1990), of which each is drawn in the rows alone that are exposed then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.render.light import decoded

_MOST = 64  # moments of a picture; what moves faster is drawn in larger steps
_STEP = 1.5  # px, from moment to moment


class Shutter(NamedTuple):
    """How long each row is exposed, and how long it takes from the first row to the last, s."""

    exposure: float
    readout: float

    def moments(self, height: int, speed: float) -> list[Exposed]:
        """Return the moments at which a picture of that height (px) is drawn, where it moves at `speed` (px/s)."""
        whole = self.exposure + self.readout
        step = max(_STEP / max(speed, 1e-9), whole / _MOST)
        if whole < step / 2:
            return [Exposed(0.0, 0, height, 1)]
        several = max(1, round(self.exposure / step))  # in which a row is exposed
        if several > 1:
            step = self.exposure / several
        middles = ((np.arange(height) + 0.5) / height - 0.5) * self.readout
        first = np.rint(middles / step - (several - 1) / 2).astype(int)  # moments of the rows; moment k is at k · step
        numbers = range(first[0], first[-1] + several)
        ends = np.searchsorted(first, numbers, "right"), np.searchsorted(first, np.subtract(numbers, several), "right")
        return [Exposed(k * step, int(start), int(end), several) for k, end, start in zip(numbers, *ends)]


class Exposed(NamedTuple):
    """A moment, s after the stamp; the first of the rows that are exposed then, and the one after the last.

    `several` is the number of moments in which each row is exposed.
    """

    time: float
    first: int
    end: int
    several: int


def gathered(
    moments: list[Exposed], size: tuple[int, int], draw: Callable[[float, int, int], np.ndarray]
) -> np.ndarray:
    """Return the light of a picture of some width and height, (height, width, 3) float32; white is 1.

    `draw` returns rows of the picture (uint8 RGB) at a time after the stamp, from the first to the one before the end.
    """
    if len(moments) == 1:
        return decoded(draw(*moments[0][:3]))
    width, height = size
    light = np.zeros((height, width, 3), np.float32)
    for time, first, end, several in moments:
        if end > first:
            part = light[first:end]
            cv2.add(part, decoded(draw(time, first, end), 1 / several), dst=part)
    return light


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
