"""Base class of imperfections: parameters with a function of the light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drone_sim.config.types import Checked
from drone_sim.render.intrinsics import Intrinsics


@dataclass(frozen=True)
class Shot:
    """The settings of one image: camera model, exposure time (s) and gain (a factor).

    `normal(seed)` returns standard normal numbers for each pixel and colour, float32, which depend only on the seed,
    the camera and the time.
    """

    lens: Intrinsics
    exposure: float
    gain: float
    normal: Callable[[int], np.ndarray]


class Imperfection(Checked):
    """Parameters of an imperfection, which is off by default."""

    @property
    def is_on(self) -> bool:
        """Whether it changes the images."""
        raise NotImplementedError

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        """Return the changed light (height, width, 3) float32; white is 1. `light` may be modified in place."""
        return light
