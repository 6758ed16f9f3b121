"""Noise of an image sensor, after the linear model of EMVA 1288 (release 4.0, 2021).

Photons free μ electrons of a pixel on average, at most its full well. Their number has shot noise, with the variance μ;
reading it adds dark noise, with the variance σ². Then it is amplified:

    value = gain / full_well · N(min(μ, full_well), μ + σ²),  μ = light · exposure / reference · full_well

So rendered white fills the well at the reference exposure. Shot noise has a Poisson distribution, approximated here by
a normal one: below some ten electrons the shape differs, while mean and variance are equal.

Values below black or above white are clipped after all imperfections. In dark regions, this increases the mean and
reduces the deviation. A value of mean m and standard deviation s that is clipped at 0 has, with the normal density φ
and the normal distribution function Φ at m / s:

    mean = m Φ + s φ,  variance = (m² + s²) Φ + m s φ - mean²
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from drone_sim.config.types import Finite, ParameterError, Unit, Within
from drone_sim.sensors.imperfections.imperfection import Imperfection, Shot


class PixelNoiseParameters(Imperfection):
    """Noise of a pixel's value from image to image."""

    full_well: Annotated[Finite, Within(100, 1e6, or_zero=True), Unit("electrons")] = Field(
        default=0.0, description="of a white pixel, which determine the shot noise; 0: no noise"
    )
    read: Annotated[Finite, Within(0, 1e4), Unit("electrons")] = Field(
        default=0.0, description="standard deviation of the read noise"
    )
    seed: Annotated[int, Within(0, 2**63 - 1)] = 0

    def model_post_init(self, _context: Any) -> None:
        """Raise ParameterError for read noise without `full_well`."""
        if self.read and not self.full_well:
            raise ParameterError("needs `full_well`, the electrons of a white pixel", ("read",), f"{self.read:g}")

    @property
    def is_on(self) -> bool:
        return self.full_well > 0

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        electrons = np.minimum(light * np.float32(self.full_well / shot.gain), np.float32(self.full_well))
        noisy = shot.normal(self.seed)
        noisy *= np.sqrt(electrons + np.float32(self.read**2))
        noisy += electrons
        noisy *= np.float32(shot.gain / self.full_well)
        return noisy
