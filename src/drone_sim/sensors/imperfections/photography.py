"""How a picture with imperfections comes about."""

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

_METERED = 64  # px, the width of the picture in which light is measured

Gather = Callable[[Intrinsics, Shutter], np.ndarray]


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
        self.is_metering = parameters.exposure.automatic  # whether it looks how bright it is, whoever looks at that

    @property
    def is_perfect(self) -> bool:
        """Whether there is nothing to do."""
        return not self._imperfections

    def take(self, lens: Intrinsics, gather: Gather) -> np.ndarray:
        """Return a picture (height, width, 3) uint8 RGB; `gather` returns the light for a lens and a shutter."""
        own = self._parameters
        time, gain = own.exposure.settings(self._brightness(lens, gather))
        shot = Shot(lens, time, gain, partial(self._normal, (lens.height, lens.width, 3)))
        light = gather(lens, Shutter(time, own.shutter.readout))
        for one in self._imperfections:
            light = one.apply(light, shot)
        return encoded(light)

    def meter(self, lens: Intrinsics, gather: Gather) -> None:
        """Look how bright it is where a picture is due."""
        own, now = self._parameters.exposure, self._clock.time
        taken = None if self._exposure.has_seen_nothing else self._exposure.brightness(own, now)
        self._exposure.meter(self._metered(lens, gather), taken, now)

    def _brightness(self, lens: Intrinsics, gather: Gather) -> float:
        own, now, control = self._parameters.exposure, self._clock.time, self._exposure
        if own.automatic and control.has_seen_nothing:
            control = ExposureControl()  # before the first that is due, which begins by itself
            control.meter(self._metered(lens, gather), None, now)
        return control.brightness(own, now)

    def _metered(self, lens: Intrinsics, gather: Gather) -> np.ndarray:
        small, vignette = _small(lens), self._parameters.vignette
        light = gather(small, Shutter(0.0, 0.0))
        if not vignette.is_on:
            return light
        return vignette.apply(light, Shot(small, 0.0, 1.0, partial(self._normal, (small.height, small.width, 3))))

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
        return in_turn(saved(self, "_parameters", "_imperfections", "is_metering"), self._exposure.save_state())


@lru_cache(maxsize=16)
def _small(lens: Intrinsics) -> Intrinsics:
    """Return a lens that sees the same in few pixels."""
    width = min(_METERED, lens.width)
    return replace(lens, width=width, height=max(1, round(lens.height * width / lens.width)))
