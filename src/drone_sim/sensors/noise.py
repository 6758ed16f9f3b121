"""Noise of a measurement: white noise, a constant bias, a drifting bias, and quantisation.

    measured = truth + c + b + n, rounded to a multiple of the quantisation
    n: white noise with the standard deviation sqrt(deviation² + density² · rate) per sample
    c: constant during a run, N(0, bias²)
    b: drifts, db/dt = -b / bias_time + bias_walk · w,  w white noise of unit density

The model, its terms and its units are those of Kalibr and RotorS (Furrer et al. 2016, Robot Operating System: The
Complete Reference 1, p. 595-625), after IEEE Std 952-1997, annex C. With bias_time 0, b is a random walk from 0 (rate
random walk); otherwise it is a stationary first-order Gauss-Markov process, exact from sample to sample:

    b' = φ b + s sqrt(1 - φ²) N(0, 1),  φ = exp(-Δt / bias_time),  s² = bias_walk² · bias_time / 2

The Allan deviation over τ is density / sqrt(τ) for the white noise, and bias_walk · sqrt(τ / 3) for a random walk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

from numpy.random import Generator
from pydantic import Field

from drone_sim.config.types import Checked, Finite, Within
from drone_sim.mechanics.saved_state import Restore, saved

_Amount = Annotated[Finite, Within(0, 1e6)]  # in the unit of the measurement
_Step = Annotated[Finite, Within(1e-15, 1e6, or_zero=True)]  # a finer step is lost in a float, or 1/step overflows
_Time = Annotated[Finite, Within(1e-3, 1e9, or_zero=True)]


def _described(text: str) -> Any:
    return Field(default=0.0, description=text)


class NoiseParameters(Checked):
    """Noise of every axis of a measurement; u is the unit of the measurement. The default is no noise."""

    deviation: _Amount = _described("u, standard deviation of a sample; u is the unit of the measurement")
    density: _Amount = _described("u/√Hz, white noise with the standard deviation density · √rate per sample")
    bias: _Amount = _described("u, standard deviation of the constant bias")
    bias_walk: _Amount = _described("u/s/√Hz")
    bias_time: _Time = _described("s, correlation time of the drift; 0: infinite, a random walk")
    quantisation: _Step = _described("u, step size; 0: none")
    variance: Annotated[Finite, Within(0, 1e12)] | None = None  # u², for messages; default: computed from the noise


class Noise:
    """The noise of a measurement with one or several independent axes."""

    def __init__(self, parameters: NoiseParameters, axes: int, interval: float):
        """Create the noise for samples `interval` seconds apart; call `restart` before the first one."""
        self._axes, self._interval = axes, interval
        self._random: Generator | None = None
        self._constant = [0.0] * axes
        self._bias = [0.0] * axes  # the drifting part
        self._set_parameters(parameters)

    def _set_parameters(self, parameters: NoiseParameters) -> None:
        p, interval = parameters, self._interval
        self.parameters = parameters
        self._white = math.sqrt(p.deviation**2 + p.density**2 / interval)
        self._spread = p.bias_walk * math.sqrt(p.bias_time / 2)  # standard deviation of the Gauss-Markov process
        if p.bias_time:
            self._keep = math.exp(-interval / p.bias_time)
            self._walk = self._spread * math.sqrt(1 - self._keep**2)
        else:
            self._keep, self._walk = 1.0, p.bias_walk * math.sqrt(interval)
        self._update_is_off()

    def _update_is_off(self) -> None:
        """Note whether a measurement is the truth; after a change of parameters a bias may remain."""
        is_shifted = any(self._constant) or any(self._bias)
        self._is_off = not (self._white or self._walk or self.parameters.quantisation or is_shifted)

    def change(self, parameters: NoiseParameters) -> None:
        """Change the parameters from the next sample on; the constant bias is scaled with its standard deviation."""
        before = self.parameters.bias
        if self._random is not None and parameters.bias != before:
            drawn = [value / before for value in self._constant] if before else _normal(self._random, self._axes)
            self._constant = [parameters.bias * value for value in drawn]
        self._set_parameters(parameters)

    @property
    def variance(self) -> float:
        """Variance of a sample's error for messages: the configured one, or that of the noise; 0 without noise.

        A random walk is not counted, since its variance has no limit.
        """
        p = self.parameters
        if p.variance is not None:
            return p.variance
        return self._white**2 + p.bias**2 + self._spread**2 + p.quantisation**2 / 12

    def restart(self, random: Generator) -> None:
        """Start a run, with random numbers from `random`."""
        self._random = random
        self._constant, self._bias = (
            [spread * value for value in _normal(random, self._axes)] if spread else [0.0] * self._axes
            for spread in (self.parameters.bias, self._spread)
        )
        self._update_is_off()

    def add(self, truth: Sequence[float]) -> list[float]:
        """Return the next noisy sample of `truth`, one number for each axis."""
        if self._random is None:
            raise RuntimeError("restart() must be called before add()")
        if self._is_off:
            return list(truth)
        # Lists of floats: for so few axes Python is faster than numpy.
        measured = [true + constant + bias for true, constant, bias in zip(truth, self._constant, self._bias)]
        if self._white:
            white, drawn = self._white, _normal(self._random, self._axes)
            measured = [value + white * number for value, number in zip(measured, drawn)]
        if self._walk:
            keep, walk, drawn = self._keep, self._walk, _normal(self._random, self._axes)
            self._bias = [keep * value + walk * number for value, number in zip(self._bias, drawn)]
        step = self.parameters.quantisation
        return [round(value / step) * step for value in measured] if step else measured

    def save_state(self) -> Restore:
        """Return a function that restores bias and parameters; the sensor restores the random generator."""
        return saved(self, "parameters", "_white", "_spread", "_keep", "_walk", "_constant", "_bias", "_is_off")


def _normal(random: Generator, count: int) -> list[float]:
    numbers: Any = random.standard_normal(count).tolist()  # numpy's type annotations differ between releases
    return numbers
