"""Vignetting: the image gets darker towards its corners.

    E = E0 cosⁿ θ,  θ the angle of a pixel's ray from the optical axis

n = 4 is the law of a thin lens (R. Kingslake, Optics in Photography, SPIE 1992, chapter 6). Pixels 90 degrees or more
off the axis get no light.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Finite, Within
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.sensors.imperfections.imperfection import Imperfection, Shot


class VignetteParameters(Imperfection):
    """Strength of the vignetting."""

    power: Annotated[Finite, Within(0, 20)] = Field(
        default=0.0, description="power of the cosine of the angle from the optical axis; 4: a thin lens; 0: none"
    )

    @property
    def is_on(self) -> bool:
        return self.power > 0

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        light *= _share(shot.lens, self.power)
        return light


@lru_cache(maxsize=16)
def _share(lens: Intrinsics, power: float) -> np.ndarray:
    """Return the share of light that reaches each pixel, (height, width, 3) float32."""
    cosine = np.nan_to_num(lens.rays[..., 2:])
    return np.asarray(np.clip(cosine, 0.0, 1.0).repeat(3, axis=2) ** power, dtype=np.float32)
