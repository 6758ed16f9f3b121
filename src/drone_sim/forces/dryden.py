"""Dryden's gusts as frozen turbulence: the gust at a place depends only on the air's way along the wind.

Spectra over the spatial frequency W (rad/m), with deviations s and lengths L (MIL-F-8785C, Flying Qualities of Piloted
Airplanes, 1980, section 3.7.1.2):

    along the wind          s² 2L/pi / (1 + (LW)²)
    across it, and up       s²  L/pi (1 + 3 (LW)²) / (1 + (LW)²)²

so over a distance r gusts correlate as s² e^(-r/L), and as s² e^(-r/L) (1 - r/2L). White noise q through the
filters 1 / (1 + p) and (1 + sqrt(3) p) / (1 + p)², p = L d/ds, has these spectra. The second one, with two states and
the gust g,

    dx/dh = y,  dy/dh = q - x - 2y,  g = x + sqrt(3) y        h = s/L

is sampled exactly (C. F. Van Loan, Computing integrals involving the matrix exponential, IEEE Trans. Automatic Control
23(3), 1978): both states have the variance 1/4 and do not correlate; over a step h they become

    e^-h [[1+h, h], [-h, 1-h]] (x, y) + noise of covariance 1/4 [[1 - e (1+2h+2h²), 2 e h²], [2 e h², 1 - e (1-2h+2h²)]]

with e = e^-2h. Frozen turbulence drifting with the wind: G. I. Taylor, The Spectrum of Turbulence, Proc. R. Soc. A
164, 1938.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.random import Generator

from drone_sim.mechanics.frames import Vector

KNOTS = 128  # per length L; linear interpolation between them costs 0.4 % of the deviation
MOST = 2**19  # knots: after 4096 lengths the same gusts repeat in reverse order
_BLOCK = 256  # knots
_TOO_FAR = 1e12  # knots


class GustSeries:
    """Gusts of one component along the way, of deviation 1: computed on demand, and the same for equal seeds."""

    def __init__(self, seed: Sequence[int], is_along: bool):
        """Create the series with this seed; `is_along`: of the gusts along the wind."""
        random = np.random.default_rng(np.random.SeedSequence(list(seed)))
        self._generator = _first_order(random) if is_along else _second_order(random)
        self._knots = array("d")
        self._end = -1  # knot up to which `at` needs not call _reach

    def at(self, way: float) -> float:
        """Return the gust after a way, in lengths L."""
        knot = abs(way) * KNOTS
        if not knot < self._end:
            if not knot < _TOO_FAR:  # also if NaN: the body's position is not finite
                return 0.0
            knot = self._reach(knot)
        index = int(knot)
        before = self._knots[index]
        return before + (knot - index) * (self._knots[index + 1] - before)

    def _reach(self, knot: float) -> float:
        """Return the knot from 0 to MOST that has the same gust, and extend the series to it."""
        knot %= 2 * MOST
        knot = min(knot, 2 * MOST - knot)
        while int(knot) + 1 >= len(self._knots):
            self._knots.extend(next(self._generator) for _ in range(_BLOCK))
        self._end = min(len(self._knots) - 1, MOST)
        return knot


class Gusts:
    """The three components: along the wind, across it (to the left), and up."""

    def __init__(self, seed: int):
        """Create the gust field of this seed."""
        self._series = [GustSeries((seed, number), is_along=number == 0) for number in range(3)]

    def at(self, way: float, deviations: Vector, lengths: Vector) -> Vector:
        """Return the gust (m/s) after a way (m), for deviations (m/s) and lengths (m)."""
        (along, across, up), (x, y, z) = self._series, deviations
        return (
            x * along.at(way / lengths[0]) if x else 0.0,
            y * across.at(way / lengths[1]) if y else 0.0,
            z * up.at(way / lengths[2]) if z else 0.0,
        )


def _normal_numbers(random: Generator) -> Iterator[float]:
    while True:
        yield from map(float, random.standard_normal(_BLOCK))


def _first_order(random: Generator) -> Iterator[float]:
    """Yield first-order gusts of deviation 1 at successive knots."""
    numbers = _normal_numbers(random)
    keep = math.exp(-1 / KNOTS)
    new = math.sqrt(1 - keep**2)
    gust = next(numbers)
    while True:
        yield gust
        gust = keep * gust + new * next(numbers)


def _second_order(random: Generator) -> Iterator[float]:
    """Yield second-order gusts of deviation 1 at successive knots."""
    numbers = _normal_numbers(random)
    h = 1 / KNOTS
    keep, e = math.exp(-h), math.exp(-2 * h)
    # Cholesky decomposition of the noise's covariance.
    first = math.sqrt(1 - e * (1 + 2 * h + 2 * h * h)) / 2
    mixed = e * h * h / 2 / first
    second = math.sqrt((1 - e * (1 - 2 * h + 2 * h * h)) / 4 - mixed**2)
    x, y = next(numbers) / 2, next(numbers) / 2
    while True:
        yield x + math.sqrt(3) * y
        a, b = next(numbers), next(numbers)
        x, y = (
            keep * ((1 + h) * x + h * y) + first * a,
            keep * (-h * x + (1 - h) * y) + mixed * a + second * b,
        )
