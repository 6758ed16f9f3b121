"""How a mass lies in a body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix


class Inertia(NamedTuple):
    """An inertia tensor (kg m², nine numbers), and the frame in which it is told: its origin is the centre of mass."""

    tensor: tuple[float, ...]
    frame: Matrix


class Inertial(NamedTuple):
    """A mass (kg), its centre (3,), and the inertia (3, 3) about that, in one frame and its axes."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    def seen_from(self, frame: Matrix) -> Inertia:
        """Return it in another frame, and along that one's axes."""
        turn = np.reshape(frame, (3, 4))[:, :3]
        x, y, z = frames.transform(frames.invert(frame), list(map(float, self.centre)))
        tensor = (turn.T @ self.inertia @ turn).ravel()
        return Inertia(tuple(map(float, tensor)), (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z))


def combined(parts: Sequence[Inertial]) -> Inertial:
    """Return several as one, by the parallel axis theorem. Raises ValueError where they have no mass."""
    mass = sum(one.mass for one in parts)
    if not mass > 0:
        raise ValueError(f"total mass {mass} kg: must be greater than 0")
    centre = sum((one.mass * one.centre for one in parts), np.zeros(3)) / mass
    inertia = sum((one.inertia + one.mass * _steiner(one.centre - centre) for one in parts), np.zeros((3, 3)))
    return Inertial(mass, centre, inertia)


def turned(inertia: Inertia, frame: Matrix) -> np.ndarray:
    """Return the tensor (3, 3) of an inertia along the axes of another frame, in which its own is `frame`."""
    turn = np.reshape(frame, (3, 4))[:, :3]
    tensor: np.ndarray = turn @ np.reshape(inertia.tensor, (3, 3)) @ turn.T
    return tensor


def _steiner(d: np.ndarray) -> np.ndarray:
    return d @ d * np.eye(3) - np.outer(d, d)
