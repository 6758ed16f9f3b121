"""Dryden's gusts, frozen into the air that drifts by: what blows at a place depends on its way along the wind alone.

Spectra over the spatial frequency W (rad/m), with deviations s and lengths L (MIL-F-8785C, Flying Qualities of Piloted
Airplanes, 1980, section 3.7.1.2):

    along the wind          s² 2L/pi / (1 + (LW)²)
    across it, and up       s²  L/pi (1 + 3 (LW)²) / (1 + (LW)²)²

so that over a distance r gusts correlate as s² e^(-r/L), and as s² e^(-r/L) (1 - r/2L). White noise q through the
filters 1 / (1 + p) and (1 + sqrt(3) p) / (1 + p)², p = L d/ds, has these spectra. The second one, with two states and
the gust g,

    dx/dh = y,  dy/dh = q - x - 2y,  g = x + sqrt(3) y        h = s/L

is sampled exactly (C. F. Van Loan, Computing integrals involving the matrix exponential, IEEE Trans. Automatic Control
23(3), 1978): both states have the variance 1/4 and do not correlate; over a step h they become

    e^-h [[1+h, h], [-h, 1-h]] (x, y) + noise of covariance 1/4 [[1 - e (1+2h+2h²), 2 e h²], [2 e h², 1 - e (1-2h+2h²)]]

with e = e^-2h. Frozen turbulence that drifts with the wind: G. I. Taylor, The Spectrum of Turbulence, Proc. R. Soc. A
164, 1938.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.random import Generator

from drone_sim.mechanics.frames import Vector

KNOTS = 128  # a length L; between them the gust goes in a straight line, which takes 0.4 % of its deviation
MOST = 2**19  # knots: after 4096 lengths the same gusts come once more, the last ones first
_AT_ONCE = 256  # knots
_NOWHERE = 1e12  # knots


class GustSeries:
    """One component's gusts along the way, of deviation 1: made as far as it was needed so far, the same for a seed."""

    def __init__(self, seed: Sequence[int], is_along: bool):
        """Take which of all series it is, and whether the gusts are those along the wind."""
        random = np.random.default_rng(np.random.SeedSequence(list(seed)))
        self._more = _along(random) if is_along else _across(random)
        self._knots = array("d")

    def at(self, way: float) -> float:
        """Return the gust after a way, counted in lengths L."""
        place = abs(way) * KNOTS
        if not place < _NOWHERE:  # nor a NaN, of a body that is nowhere
            return 0.0
        place %= 2 * MOST
        place = min(place, 2 * MOST - place)
        index = int(place)
        while index + 1 >= len(self._knots):
            self._knots.extend(next(self._more) for _ in range(_AT_ONCE))
        before, after = self._knots[index], self._knots[index + 1]
        return before + (place - index) * (after - before)


class Gusts:
    """The three components: along the wind, across it to the left, up."""

    def __init__(self, seed: int):
        """Begin a field that the seed tells from others."""
        self._series = [GustSeries((seed, number), is_along=number == 0) for number in range(3)]

    def at(self, way: float, deviations: Vector, lengths: Vector) -> Vector:
        """Return the gust (m/s) after a way (m), of so large deviations (m/s) and lengths (m)."""
        (along, across, up), (x, y, z) = self._series, deviations
        return (
            x * along.at(way / lengths[0]) if x else 0.0,
            y * across.at(way / lengths[1]) if y else 0.0,
            z * up.at(way / lengths[2]) if z else 0.0,
        )


def _normal(random: Generator) -> Iterator[float]:
    while True:
        yield from map(float, random.standard_normal(_AT_ONCE))


def _along(random: Generator) -> Iterator[float]:
    """Yield first-order gusts at one knot after the other, of deviation 1."""
    drawn = _normal(random)
    keep = math.exp(-1 / KNOTS)
    new = math.sqrt(1 - keep**2)
    gust = next(drawn)
    while True:
        yield gust
        gust = keep * gust + new * next(drawn)


def _across(random: Generator) -> Iterator[float]:
    """Yield second-order gusts at one knot after the other, of deviation 1."""
    drawn = _normal(random)
    h = 1 / KNOTS
    keep, old = math.exp(-h), math.exp(-2 * h)
    # The noise's covariance as L Lᵀ, L lower triangular: Cholesky's square root.
    first = math.sqrt(1 - old * (1 + 2 * h + 2 * h * h)) / 2
    mixed = old * h * h / 2 / first
    second = math.sqrt((1 - old * (1 - 2 * h + 2 * h * h)) / 4 - mixed**2)
    x, y = next(drawn) / 2, next(drawn) / 2
    while True:
        yield x + math.sqrt(3) * y
        one, other = next(drawn), next(drawn)
        x, y = (
            keep * ((1 + h) * x + h * y) + first * one,
            keep * (-h * x + (1 - h) * y) + mixed * one + second * other,
        )
