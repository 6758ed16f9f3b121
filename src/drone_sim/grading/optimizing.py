"""The best values between bounds, by SciPy's differential evolution.

Points are given for what is passed or failed, so that the cost has steps, and no slope to go down: a population finds
its way over steps, a simplex stands still on them. A whole generation is flown at a time, on all workers, and the same
seed gives the same search on one worker and on many; optuna, which learns from each trial as it ends, does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import differential_evolution

_OF_A_PARAMETER = 5  # members of the population
_FEWEST = 5  # of all, which the method needs
_DIGITS = 6  # of a value: what nobody would type decides nothing

Costs = Callable[[Sequence[tuple[float, ...]]], Sequence[float]]


def search(costs: Costs, bounds: Sequence[tuple[float, float]], evaluations: int, seed: int) -> None:
    """Ask for the costs of one generation of points after the other: about so many in all."""
    population = max(_FEWEST, _OF_A_PARAMETER * len(bounds))
    generator = np.random.default_rng(seed)
    first = np.array(bounds).T[0] + generator.random((population, len(bounds))) * np.ptp(bounds, axis=1)
    differential_evolution(
        lambda points: np.array(costs([tuple(float(f"{value:.{_DIGITS}g}") for value in one) for one in points.T])),
        bounds,
        init=first,
        maxiter=max(0, evaluations // population - 1),
        seed=generator,
        polish=False,
        updating="deferred",
        vectorized=True,
        tol=0,
    )
