"""How a mass lies in a shape that is evenly filled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh

from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.shapes.compound import Part
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.shape import DrawnShape

_THIN = 1e-9  # of the bounds' volume: what has less is taken for a box of its bounds


class Inertia(NamedTuple):
    """Principal moments (kg m²), and the shape's frame from that of the centre of mass and the principal axes."""

    moments: tuple[float, float, float]
    frame: Matrix = IDENTITY


def inertia_of(parts: Sequence[Part], mass: float) -> Inertia:
    """Return the inertia of a mass (kg) that fills some parts evenly; a mesh counts as its convex hull.

    Raises ValueError, in one line, for a mesh that cannot be read.
    """
    solids = [_solid(part) for part in parts]
    volumes = np.array([one.volume for one in solids])
    masses = mass * volumes / volumes.sum()
    centre = sum(one.center_mass * part for one, part in zip(solids, masses)) / mass
    tensor = np.zeros((3, 3))
    for one, share in zip(solids, masses):
        arm = one.center_mass - centre
        tensor += one.moment_inertia * (share / one.volume) + share * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return principal(tensor, centre)


def principal(tensor: np.ndarray, centre: np.ndarray) -> Inertia:
    """Return an inertia tensor (3, 3) about a centre of mass (3,), both in a shape's frame, by its principal axes."""
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= 1e-6 * np.trace(tensor):
        moments, axes = np.diag(tensor), np.eye(3)
    else:
        moments, axes = np.linalg.eigh(tensor)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
    a, b, c = map(float, moments)
    return Inertia((a, b, c), tuple(map(float, np.hstack([axes, np.reshape(centre, (3, 1))]).ravel())))


def _solid(part: Part) -> trimesh.Trimesh:
    """Return what a part fills, in the frame of the whole."""
    shape = part.shape
    corners = [one.corners for one in shape.triangles()] if isinstance(shape, DrawnShape) else []
    if not corners:
        raise ValueError(f"{shape}: its mass cannot be told from its form")
    whole = trimesh.Trimesh(**trimesh.triangles.to_kwargs(np.concatenate(corners)))
    whole.merge_vertices()
    extents = np.maximum(whole.extents, 1e-4)
    solid = _hull(whole) if isinstance(shape, Mesh) else whole
    if solid is None or not solid.volume > _THIN * np.prod(extents):
        solid = trimesh.creation.box(extents, trimesh.transformations.translation_matrix(np.mean(_bounds(corners), 0)))
    solid.apply_transform(np.reshape((*part.local, 0, 0, 0, 1), (4, 4)))
    return solid


def _hull(solid: trimesh.Trimesh) -> trimesh.Trimesh | None:
    try:
        return solid.convex_hull
    except Exception:  # whatever Qhull says of what is flat
        return None


def _bounds(corners: list[np.ndarray]) -> np.ndarray:
    points = np.concatenate(corners).reshape(-1, 3)
    return np.array([points.min(axis=0), points.max(axis=0)])
