"""Mass properties of evenly filled shapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.inertia import Inertial, combined
from drone_sim.shapes.compound import Part
from drone_sim.shapes.shape import DrawnShape


class PrincipalInertia(NamedTuple):
    """Principal moments (kg m²), and the pose of the shape in the frame of centre of mass and principal axes."""

    moments: tuple[float, float, float]
    frame: Matrix = IDENTITY


def inertia_of(parts: Sequence[Part], mass: float) -> PrincipalInertia:
    """Return the inertia of a mass (kg) that fills `parts` evenly; a mesh counts as its convex hull.

    Raises ValueError, in one line, for a mesh that cannot be read.
    """
    solids = [_of_unit_density(part) for part in parts]
    density = mass / sum(solid.mass for solid in solids)
    whole = combined([Inertial(density * solid.mass, solid.centre, density * solid.inertia) for solid in solids])
    return principal(whole.inertia, whole.centre)


def principal(tensor: np.ndarray, centre: np.ndarray) -> PrincipalInertia:
    """Return an inertia tensor (3, 3) about a centre of mass (3,), both in a shape's frame, by its principal axes."""
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= 1e-6 * np.trace(tensor):
        moments, axes = np.diag(tensor), np.eye(3)
    else:
        moments, axes = np.linalg.eigh(tensor)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
    a, b, c = map(float, moments)
    return PrincipalInertia((a, b, c), tuple(map(float, np.hstack([axes, np.reshape(centre, (3, 1))]).ravel())))


def _of_unit_density(part: Part) -> Inertial:
    """Return a part, filled with 1 kg/m³, in the frame of the whole shape."""
    if not isinstance(part.shape, DrawnShape):
        raise ValueError(f"{part.shape}: its mass cannot be computed from its form")
    solid = part.shape.solid()
    local = np.reshape(part.local, (3, 4))
    rotation, position = local[:, :3], local[:, 3]
    return Inertial(solid.volume, rotation @ solid.centroid + position, rotation @ solid.inertia @ rotation.T)
