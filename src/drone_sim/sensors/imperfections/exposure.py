"""How long the sensor is exposed, and how much its signal is amplified; set, or following what is seen.

    light' = light · time / reference · 10^(gain / 20)

With automatic exposure, the product approaches the value that brings the mean luminance (ITU-R BT.709) to 18 %, middle
grey: `settling` is the time constant, after which 1/e of the distance, in stops, is left. The exposure time changes
first, up to the value that is set, then the gain, up to its own. As in real cameras, a picture's exposure follows from
the light measured before it; the first picture's from its own. The light is measured in a small picture whenever one is
due, so that it does not matter who looks.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import cv2
import numpy as np
from pydantic import Field

from drone_sim.config.types import Finite, ParameterError, Switch, Unit, Within
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.sensors.imperfections.imperfection import Imperfection, Shot

_GREY = 0.18
_LUMINANCE = (0.2126, 0.7152, 0.0722)
_DARKEST = 1e-4  # mean luminance that is told from black
_SHORTEST = 1e-6  # s


class ExposureParameters(Imperfection):
    """Exposure time and gain."""

    time: Annotated[Finite, Within(1e-6, 1, or_zero=True), Unit("s")] = Field(
        default=0.0, description="moving things are blurred over this time; 0: an instant, as bright as it is drawn"
    )
    gain: Annotated[Finite, Within(0, 60), Unit("dB")] = 0.0
    automatic: Switch = Field(default=False, description="true: time and gain are the largest values that it uses")
    reference: Annotated[Finite, Within(1e-6, 1), Unit("s")] = Field(
        default=0.01, description="the exposure time with normal brightness, without gain"
    )
    settling: Annotated[Finite, Within(0, 60), Unit("s")] = Field(
        default=0.2, description="how slowly the automatic exposure follows the picture"
    )

    def model_post_init(self, _context: Any) -> None:
        """Refuse to follow without an exposure time."""
        if self.automatic and not self.time:
            raise ParameterError("needs `time`, the longest exposure time", ("automatic",), "true")

    @property
    def is_on(self) -> bool:
        """Whether it changes the pictures."""
        return self.time > 0 or self.gain > 0

    @property
    def most(self) -> float:
        """How much brighter than drawn pictures can be."""
        brightness = self.time / self.reference if self.time else 1.0
        return brightness * 10 ** (self.gain / 20)

    def settings(self, brightness: float) -> tuple[float, float]:
        """Return exposure time (s) and gain (a factor) that make pictures so much brighter than drawn."""
        if not self.time:
            return 0.0, brightness
        time = min(max(brightness * self.reference, _SHORTEST), self.time)
        return time, max(1.0, brightness * self.reference / time)

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        """Brighten or darken it."""
        light *= np.float32((shot.exposure / self.reference if shot.exposure else 1.0) * shot.gain)
        return light


class ExposureControl:
    """The present exposure of a camera: how much brighter its pictures are than drawn."""

    def __init__(self) -> None:
        """Know nothing of what is seen yet."""
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._brightness, self._wanted, self._at = 0.0, 1.0, 0.0

    @property
    def has_seen_nothing(self) -> bool:
        """Whether `meter` has to be called before there is a brightness."""
        return self._brightness == 0.0

    def brightness(self, parameters: ExposureParameters, now: float) -> float:
        """Return the brightness of a picture at a time (s)."""
        if not parameters.automatic:
            return parameters.most
        left = math.exp((self._at - now) / parameters.settling) if parameters.settling else float(now == self._at)
        return min(self._wanted * (self._brightness / self._wanted) ** left, parameters.most)

    def meter(self, light: np.ndarray, brightness: float | None, now: float) -> None:
        """Measure the light of a picture at a time (s), before it is brightened; it was taken with this brightness."""
        mean = float(np.dot(cv2.mean(light)[:3], _LUMINANCE))
        self._wanted, self._at = _GREY / max(mean, _DARKEST), now
        self._brightness = self._wanted if brightness is None else brightness

    def save_state(self) -> Restore:
        """Return a function that brings it back."""
        return saved(self, "_brightness", "_wanted", "_at")
