"""The noise of an image sensor, as the linear model of EMVA 1288 (release 4.0, 2021) has it.

A pixel holds as many electrons as photons have freed, on the average μ, and at most its full well. Their number varies
by the shot noise, of variance μ; reading it adds the dark noise, of variance σ². Then it is amplified:

    value = gain / full_well · N(min(μ, full_well), μ + σ²),  μ = light · exposure / reference · full_well

So white as it is drawn fills the well at the reference exposure. The shot noise is Poisson's, here by its normal
approximation: of a mean below some ten electrons the shape is another one, mean and variance are the same.

A picture cannot hold values below black or above white: they are cut off after all imperfections. In the dark, this
makes the mean larger and the deviation smaller. A value of mean m and standard deviation s that is cut at 0 has, with
the normal density φ and the normal distribution function Φ at m / s:

    mean = m Φ + s φ,  variance = (m² + s²) Φ + m s φ - mean²
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from drone_sim.config.types import Finite, ParameterError, Unit, Within
from drone_sim.sensors.imperfections.imperfection import Imperfection, Shot


class PixelNoiseParameters(Imperfection):
    """How much a pixel's value varies from picture to picture."""

    full_well: Annotated[Finite, Within(100, 1e6, or_zero=True), Unit("electrons")] = Field(
        default=0.0, description="of a white pixel, which give the shot noise; 0: no noise"
    )
    read: Annotated[Finite, Within(0, 1e4), Unit("electrons")] = Field(
        default=0.0, description="standard deviation of the noise from reading"
    )
    seed: Annotated[int, Within(0, 2**63 - 1)] = 0

    def model_post_init(self, _context: Any) -> None:
        """Refuse noise in electrons without `full_well`, the number of electrons in a white pixel."""
        if self.read and not self.full_well:
            raise ParameterError("needs `full_well`, the electrons of a white pixel", ("read",), f"{self.read:g}")

    @property
    def is_on(self) -> bool:
        """Whether it changes the pictures."""
        return self.full_well > 0

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        """Add it."""
        electrons = np.minimum(light * np.float32(self.full_well / shot.gain), np.float32(self.full_well))
        varied = shot.normal(self.seed)
        varied *= np.sqrt(electrons + np.float32(self.read**2))
        varied += electrons
        varied *= np.float32(shot.gain / self.full_well)
        return varied
