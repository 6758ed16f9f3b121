"""Renders images with a camera's imperfections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

import cv2
import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.light import encoded
from drone_sim.render.shutter import Shutter
from drone_sim.sensors.imperfections import Imperfections
from drone_sim.sensors.imperfections.exposure import ExposureControl
from drone_sim.sensors.imperfections.imperfection import Imperfection, Shot

_METERING_WIDTH = 64  # px, width of the image in which light is measured

Gather = Callable[[Intrinsics, Shutter], np.ndarray]


class Photography:
    """The images of one camera with its imperfections."""

    def __init__(self, name: str, clock: Clock):
        """`name` and the simulation's clock seed the noise; call `change` next."""
        self._name, self._clock = name, clock
        self._exposure = ExposureControl()

    def change(self, parameters: Imperfections) -> None:
        self._parameters = parameters
        imperfections: list[Imperfection] = [getattr(parameters, name) for name in Imperfections.model_fields]
        self._imperfections = [imperfection for imperfection in imperfections if imperfection.is_on]
        self.is_metering = parameters.exposure.automatic  # whether it measures light, with or without viewers

    @property
    def is_perfect(self) -> bool:
        return not self._imperfections

    def take(self, lens: Intrinsics, gather: Gather) -> np.ndarray:
        """Return an image (height, width, 3) uint8 RGB; `gather` returns the light for a lens and a shutter."""
        parameters = self._parameters
        time, gain = parameters.exposure.settings(self._brightness(lens, gather))
        shot = Shot(lens, time, gain, partial(self._normal, (lens.height, lens.width, 3)))
        light = gather(lens, Shutter(time, parameters.shutter.readout))
        for imperfection in self._imperfections:
            light = imperfection.apply(light, shot)
        return encoded(light)

    def meter(self, lens: Intrinsics, gather: Gather) -> None:
        """Measure the light; called when an image is due."""
        parameters, now = self._parameters.exposure, self._clock.time
        brightness = None if self._exposure.has_seen_nothing else self._exposure.brightness(parameters, now)
        self._exposure.meter(self._measure_light(lens, gather), brightness, now)

    def _brightness(self, lens: Intrinsics, gather: Gather) -> float:
        parameters, now, control = self._parameters.exposure, self._clock.time, self._exposure
        if parameters.automatic and control.has_seen_nothing:
            control = ExposureControl()  # temporary: the first due image will start the real one
            control.meter(self._measure_light(lens, gather), None, now)
        return control.brightness(parameters, now)

    def _measure_light(self, lens: Intrinsics, gather: Gather) -> np.ndarray:
        small, vignette = _downscaled(lens), self._parameters.vignette
        light = gather(small, Shutter(0.0, 0.0))
        if not vignette.is_on:
            return light
        return vignette.apply(light, Shot(small, 0.0, 1.0, partial(self._normal, (small.height, small.width, 3))))

    def _normal(self, shape: tuple[int, int, int], seed: int) -> np.ndarray:
        entropy = [seed, *self._name.encode(), self._clock.steps]
        cv2.setRNGSeed(int(np.random.SeedSequence(entropy).generate_state(1)[0]) & 0x7FFFFFFF)
        numbers = np.empty((shape[0], shape[1] * shape[2]), np.float32)
        cv2.randn(numbers, np.zeros(1), np.ones(1))  # several times faster than numpy
        return numbers.reshape(shape)

    def reset(self) -> None:
        self._exposure.reset()

    def save_state(self) -> Restore:
        """Return a function that restores imperfections and exposure."""
        return in_turn(saved(self, "_parameters", "_imperfections", "is_metering"), self._exposure.save_state())


@lru_cache(maxsize=16)
def _downscaled(lens: Intrinsics) -> Intrinsics:
    """Return a lens with the same view and fewer pixels."""
    width = min(_METERING_WIDTH, lens.width)
    return replace(lens, width=width, height=max(1, round(lens.height * width / lens.width)))
