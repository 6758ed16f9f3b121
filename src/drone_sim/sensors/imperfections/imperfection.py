"""What an imperfection is: parameters, and what becomes of light by them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drone_sim.config.types import Checked
from drone_sim.render.intrinsics import Intrinsics


@dataclass(frozen=True)
class Shot:
    """One picture that is taken: through which lens, exposed for how long (s), amplified by how much.

    `normal` returns standard normal numbers for each pixel and colour, float32, by a seed: always the same for a
    picture of the same camera and time.
    """

    lens: Intrinsics
    exposure: float
    gain: float
    normal: Callable[[int], np.ndarray]


class Imperfection(Checked):
    """The parameters of an imperfection, which is off by default."""

    @property
    def is_on(self) -> bool:
        """Whether it changes the pictures."""
        raise NotImplementedError

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        """Return what becomes of light (height, width, 3) float32, of which white is 1; it may be changed itself."""
        return light
