"""Exposure time and gain of the image sensor, fixed or automatic; and the time of a rolling shutter (render.shutter).

    light' = light · time / reference · 10^(gain / 20)

Automatic exposure controls the product of time and gain so that the mean luminance (ITU-R BT.709) approaches 18 %,
middle grey. `settling` is the time constant, after which 1/e of the difference, in stops, is left. The exposure time
changes first, up to the configured value, then the gain, up to its configured value. As in real cameras, an image's
exposure depends on light measured before it; the first image is metered itself. The light is measured in a small image
whenever an image is due, so that the result does not depend on viewers.
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
_MIN_LUMINANCE = 1e-4  # minimum mean luminance; avoids a division by 0
_MIN_TIME = 1e-6  # s


class ShutterParameters(Imperfection):
    """Timing of a rolling shutter, which exposes the rows of an image one after another."""

    readout: Annotated[Finite, Within(0, 1), Unit("s")] = Field(
        default=0.0, description="from the first row to the last; 0: all rows at once"
    )

    @property
    def is_on(self) -> bool:
        return self.readout > 0


class ExposureParameters(Imperfection):
    """Exposure time and gain."""

    time: Annotated[Finite, Within(1e-6, 1, or_zero=True), Unit("s")] = Field(
        default=0.0, description="moving objects are blurred over this time; 0: no blur, the rendered brightness"
    )
    gain: Annotated[Finite, Within(0, 60), Unit("dB")] = 0.0
    automatic: Switch = Field(default=False, description="true: time and gain are the upper limits")
    reference: Annotated[Finite, Within(1e-6, 1), Unit("s")] = Field(
        default=0.01, description="the exposure time that gives the rendered brightness without gain"
    )
    settling: Annotated[Finite, Within(0, 60), Unit("s")] = Field(
        default=0.2, description="time constant of the automatic exposure"
    )

    def model_post_init(self, _context: Any) -> None:
        """Raise ParameterError for automatic exposure without `time`."""
        if self.automatic and not self.time:
            raise ParameterError("needs time, the longest exposure time", ("automatic",), "true")

    @property
    def is_on(self) -> bool:
        return self.time > 0 or self.gain > 0

    @property
    def most(self) -> float:
        """The largest brightness of images, relative to the rendered ones."""
        brightness = self.time / self.reference if self.time else 1.0
        return brightness * 10 ** (self.gain / 20)

    def settings(self, brightness: float) -> tuple[float, float]:
        """Return exposure time (s) and gain (a factor) for a brightness relative to the rendered image."""
        if not self.time:
            return 0.0, brightness
        time = min(max(brightness * self.reference, _MIN_TIME), self.time)
        return time, max(1.0, brightness * self.reference / time)

    def apply(self, light: np.ndarray, shot: Shot) -> np.ndarray:
        light *= np.float32((shot.exposure / self.reference if shot.exposure else 1.0) * shot.gain)
        return light


class ExposureControl:
    """The present exposure of a camera, as brightness relative to the rendered images."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self._brightness, self._wanted, self._at = 0.0, 1.0, 0.0

    @property
    def has_seen_nothing(self) -> bool:
        """Whether `meter` must be called before `brightness`."""
        return self._brightness == 0.0

    def brightness(self, parameters: ExposureParameters, now: float) -> float:
        """Return the brightness of an image at the time `now` (s)."""
        if not parameters.automatic:
            return parameters.most
        left = math.exp((self._at - now) / parameters.settling) if parameters.settling else float(now == self._at)
        return min(self._wanted * (self._brightness / self._wanted) ** left, parameters.most)

    def meter(self, light: np.ndarray, brightness: float | None, now: float) -> None:
        """Set the target from a rendered image at `now` (s). `brightness`: the present value (None: the target)."""
        mean = float(np.dot(cv2.mean(light)[:3], _LUMINANCE))
        self._wanted, self._at = _GREY / max(mean, _MIN_LUMINANCE), now
        self._brightness = self._wanted if brightness is None else brightness

    def save_state(self) -> Restore:
        return saved(self, "_brightness", "_wanted", "_at")
