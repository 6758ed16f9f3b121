"""How a picture with imperfections comes about."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

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


class Photography:
    """The pictures of one camera with its imperfections."""

    def __init__(self, name: str, clock: Clock):
        """Take the camera's name, which its noise depends on, and the simulation's clock; `change` comes next."""
        self._name, self._clock = name, clock
        self._exposure = ExposureControl()

    def change(self, parameters: Imperfections) -> None:
        """Have these imperfections."""
        self._parameters = parameters
        every: list[Imperfection] = [getattr(parameters, name) for name in Imperfections.model_fields]
        self._imperfections = [one for one in every if one.is_on]

    @property
    def is_perfect(self) -> bool:
        """Whether there is nothing to do."""
        return not self._imperfections

    def take(self, lens: Intrinsics, gather: Callable[[Shutter], np.ndarray]) -> np.ndarray:
        """Return a picture (height, width, 3) uint8 RGB; `gather` returns the light for a shutter."""
        own, now = self._parameters, self._clock.time
        if own.exposure.automatic and self._exposure.has_seen_nothing:
            self._exposure.meter(gather(Shutter(0.0, 0.0)), None, now)
        brightness = self._exposure.brightness(own.exposure, now)
        time, gain = own.exposure.settings(brightness)
        shot = Shot(lens, time, gain, partial(self._normal, (lens.height, lens.width, 3)))
        light = gather(Shutter(time, own.shutter.readout))
        for one in self._imperfections:
            if one is own.exposure and one.automatic:
                self._exposure.meter(light, brightness, now)
            light = one.apply(light, shot)
        return encoded(light)

    def _normal(self, shape: tuple[int, int, int], seed: int) -> np.ndarray:
        words = [seed, *self._name.encode(), self._clock.steps]
        cv2.setRNGSeed(int(np.random.SeedSequence(words).generate_state(1)[0]) & 0x7FFFFFFF)
        numbers = np.empty((shape[0], shape[1] * shape[2]), np.float32)
        cv2.randn(numbers, np.zeros(1), np.ones(1))  # several times sooner than numpy
        return numbers.reshape(shape)

    def reset(self) -> None:
        """Begin anew, as at the start of a run."""
        self._exposure.reset()

    def save_state(self) -> Restore:
        """Return a function that brings back imperfections and exposure."""
        return in_turn(saved(self, "_parameters", "_imperfections"), self._exposure.save_state())
