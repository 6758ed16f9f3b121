"""Mass properties of rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix


class Inertia(NamedTuple):
    """An inertia tensor (kg m², nine numbers) and the frame of its axes, with its origin at the centre of mass."""

    tensor: tuple[float, ...]
    frame: Matrix


class Inertial(NamedTuple):
    """A mass (kg), its centre (3,), and the inertia (3, 3) about that centre, along the axes of the same frame."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    def seen_from(self, frame: Matrix) -> Inertia:
        """Return the inertia along the axes of `frame`, and with the centre of mass in `frame`."""
        rotation = np.reshape(frame, (3, 4))[:, :3]
        x, y, z = frames.transform(frames.invert(frame), list(map(float, self.centre)))
        tensor = (rotation.T @ self.inertia @ rotation).ravel()
        return Inertia(tuple(map(float, tensor)), (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z))


def combined(parts: Sequence[Inertial]) -> Inertial:
    """Return the sum of bodies, by the parallel axis theorem. Raises ValueError if they have no mass."""
    mass = sum(part.mass for part in parts)
    if not mass > 0:
        raise ValueError(f"total mass {mass} kg: must be greater than 0")
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    inertia = sum((part.inertia + part.mass * _steiner(part.centre - centre) for part in parts), np.zeros((3, 3)))
    return Inertial(mass, centre, inertia)


def turned(inertia: Inertia, frame: Matrix) -> np.ndarray:
    """Return the tensor (3, 3) along other axes: those of the frame in which the inertia's own frame is `frame`."""
    rotation = np.reshape(frame, (3, 4))[:, :3]
    tensor: np.ndarray = rotation @ np.reshape(inertia.tensor, (3, 3)) @ rotation.T
    return tensor


def _steiner(d: np.ndarray) -> np.ndarray:
    return d @ d * np.eye(3) - np.outer(d, d)
