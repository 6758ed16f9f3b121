"""Places in the world, and how far a flight was from them."""

from __future__ import annotations

from typing import Literal

import numpy as np

from drone_sim.grading.criteria.criterion import Bound, Criterion, Missed, figure
from drone_sim.grading.flown import Flown
from drone_sim.grading.result import Outcome
from drone_sim.wording import near_names

Axes = Literal["xyz", "xy", "xz", "yz", "x", "y", "z"]
Measure = Literal["largest", "mean", "rms"]
_WORDS = {"largest": "up to", "mean": "in the mean", "rms": "in the root mean square"}


class DistanceCriterion(Criterion):
    """A distance (m) along some axes of the world that is not to be larger than `at_most`."""

    at_most: Bound
    axes: Axes = "xyz"
    measure: Measure = "largest"

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"at most {figure(self.at_most, 'm')}"

    def _along(self, vectors: np.ndarray) -> np.ndarray:
        """Return the columns of (..., 3) that count."""
        return vectors[..., ["xyz".index(axis) for axis in self.axes]]

    def _outcome_of(self, distances: np.ndarray, times: np.ndarray, what: str) -> Outcome:
        """Return the outcome of distances (M,) at these times (M,); `what` they are from, in words."""
        worst = int(distances.argmax())
        value = {
            "largest": float(distances[worst]),
            "mean": float(distances.mean()),
            "rms": float(np.sqrt((distances**2).mean())),
        }[self.measure]
        when = f" at {times[worst]:.2f} s" if self.measure == "largest" else ""
        said = f"was {_WORDS[self.measure]} {figure(value, 'm')} from {what}{when}; {self.allowed} are allowed"
        return self._outcome(value <= self.at_most, said, value, "m", float(times[worst]))


def places_of(flown: Flown, part: np.ndarray) -> np.ndarray:
    """Return where the vehicle was in a part of the flight, (M, 3) in m. Raises Missed where that is no place."""
    places = flown.rows[part, 1:4]
    if not np.isfinite(places).all():
        raise Missed("the table says at some time that the vehicle was nowhere")
    return places


def poses_of(flown: Flown, name: str, part: np.ndarray) -> np.ndarray:
    """Return the poses of another vehicle or object in a part of the flight, (M, 7): see Flown. Raises Missed."""
    if name not in flown.others:
        raise Missed(f"nothing was seen of '{name}'; {near_names(name, flown.others)}")
    poses = flown.others[name][part]
    gone = np.flatnonzero(~np.isfinite(poses).all(axis=1))
    if len(gone):
        raise Missed(f"{name} is gone at {flown.times[part][gone[0]]:.2f} s")
    return poses


def to_polyline(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances (M,) from places (M, D) to the nearest point of a polyline with corners (K, D), K >= 2."""
    squares = np.full(len(places), np.inf)
    for start, way in zip(corners[:-1], np.diff(corners, axis=0)):  # in turn: a flight may have many rows
        to, length = places - start, float(way @ way)
        share = np.clip(to @ way / length, 0, 1) if length else np.zeros(len(places))
        squares = np.minimum(squares, ((to - share[:, None] * way) ** 2).sum(axis=1))
    return np.sqrt(squares)
