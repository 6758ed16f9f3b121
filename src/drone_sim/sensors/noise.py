"""What sets a measurement apart from the truth: white noise, a bias that wanders, steps of a scale.

    measured = truth + c + b + n, rounded to whole steps of the quantisation
    n: white; of standard deviation sqrt(deviation² + density² · rate) in every sample
    c: constant through a run, N(0, bias²)
    b: wanders, db/dt = -b / bias_time + bias_walk · w,  w white of unit density

The model, its words and its units are those of Kalibr and RotorS (Furrer et al. 2016, Robot Operating System: The
Complete Reference 1, p. 595-625), after IEEE Std 952-1997, annex C: with bias_time 0 b is a random walk from 0 (rate
random walk); with any other it is a first-order Gauss-Markov process, stationary, and exact from sample to sample:

    b' = φ b + s sqrt(1 - φ²) N(0, 1),  φ = exp(-Δt / bias_time),  s² = bias_walk² · bias_time / 2

The Allan deviation over τ is density / sqrt(τ) of the white part, and bias_walk · sqrt(τ / 3) of a random walk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

from numpy.random import Generator
from pydantic import Field

from drone_sim.config.types import Checked, Finite, Within
from drone_sim.mechanics.saved_state import Restore, saved

_Amount = Annotated[Finite, Within(0, 1e6)]  # in the unit of what is measured; any of them left out is 0
_Step = Annotated[Finite, Within(1e-15, 1e6, or_zero=True)]  # what is finer is lost in a float, or has no reciprocal
_Time = Annotated[Finite, Within(1e-3, 1e9, or_zero=True)]


def _said(text: str) -> Any:
    return Field(default=0.0, description=text)


class NoiseParameters(Checked):
    """What is wrong with every axis of a measurement in some unit u; what is left out is 0."""

    deviation: _Amount = _said("u, standard deviation of a sample; u is the unit of what is measured")
    density: _Amount = _said("u/√Hz, the same in proportion to the square root of the rate")
    bias: _Amount = _said("u, standard deviation of the constant bias")
    bias_walk: _Amount = _said("u/s/√Hz")
    bias_time: _Time = _said("s, in which what wanders forgets; 0: never")
    quantisation: _Step = _said("u, of a step; 0: none")
    variance: Annotated[Finite, Within(0, 1e12)] | None = None  # u², what messages say; what the others come to if none


class Noise:
    """The noise of one measurement of some axes, which are independent of each other."""

    def __init__(self, parameters: NoiseParameters, axes: int, interval: float):
        """Take what it is like, for samples `interval` seconds apart; `restart` comes before the first."""
        self._axes, self._interval = axes, interval
        self._random: Generator | None = None
        self._constant = [0.0] * axes
        self._bias = [0.0] * axes  # that wanders
        self._be(parameters)

    def _be(self, parameters: NoiseParameters) -> None:
        own, interval = parameters, self._interval
        self.parameters = parameters
        self._white = math.sqrt(own.deviation**2 + own.density**2 / interval)
        self._spread = own.bias_walk * math.sqrt(own.bias_time / 2)  # of the Gauss-Markov process
        if own.bias_time:
            self._keep = math.exp(-interval / own.bias_time)
            self._walk = self._spread * math.sqrt(1 - self._keep**2)
        else:
            self._keep, self._walk = 1.0, own.bias_walk * math.sqrt(interval)

    def change(self, parameters: NoiseParameters) -> None:
        """Be like this from the next sample on; the constant bias grows or shrinks with its standard deviation."""
        before = self.parameters.bias
        if self._random is not None and parameters.bias != before:
            drawn = [one / before for one in self._constant] if before else _drawn(self._random, self._axes)
            self._constant = [parameters.bias * one for one in drawn]
        self._be(parameters)

    @property
    def variance(self) -> float:
        """Variance of a sample's error, as messages are to say: as configured, or what the noise comes to.

        A random walk, whose variance has no end, counts for nothing in it. 0 where there is no noise at all.
        """
        own = self.parameters
        if own.variance is not None:
            return own.variance
        return self._white**2 + own.bias**2 + self._spread**2 + own.quantisation**2 / 12

    def restart(self, random: Generator) -> None:
        """Begin anew, drawing from `random`."""
        self._random = random
        self._constant, self._bias = (
            [spread * one for one in _drawn(random, self._axes)] if spread else [0.0] * self._axes
            for spread in (self.parameters.bias, self._spread)
        )

    def add(self, truth: Sequence[float]) -> list[float]:
        """Return the next sample of a truth, one number for each axis."""
        if self._random is None:
            raise RuntimeError("noise that has not been started")
        # Lists of floats: of so few axes numpy takes longer for a sum than Python does.
        measured = [true + constant + bias for true, constant, bias in zip(truth, self._constant, self._bias)]
        if self._white:
            white, drawn = self._white, _drawn(self._random, self._axes)
            measured = [one + white * by for one, by in zip(measured, drawn)]
        if self._walk:
            keep, walk, drawn = self._keep, self._walk, _drawn(self._random, self._axes)
            self._bias = [keep * one + walk * by for one, by in zip(self._bias, drawn)]
        step = self.parameters.quantisation
        return [round(one / step) * step for one in measured] if step else measured

    def save_state(self) -> Restore:
        """Return a function that brings back bias and parameters; the random generator is the sensor's to restore."""
        return saved(self, "parameters", "_white", "_spread", "_keep", "_walk", "_constant", "_bias")


def _drawn(random: Generator, count: int) -> list[float]:
    numbers: Any = random.standard_normal(count).tolist()  # numpy's own types for it differ between releases
    return numbers
