"""Which spheres, and which of their shadows, can be in a picture."""

from __future__ import annotations

import math

import numpy as np

from drone_sim.render.programs import TO_SUN

_SLOPE = np.array(TO_SUN[:2]) / TO_SUN[2]  # m that a shadow moves in x and y per metre of height
_STRETCH = math.hypot(1.0, *_SLOPE)  # of a shadow, along the light's direction


def in_view(
    centres: np.ndarray, radii: np.ndarray, clip_from_world: np.ndarray, floor_height: float | None = None
) -> np.ndarray:
    """Return whether a part of each sphere, (N, 3) and (N,), m, may be in a view, or of its shadow on a floor; (N,).

    clip_from_world: (4, 4), or (tiles, 4, 4) for any of several views. floor_height: z, m; None: no shadows.
    """
    rows = clip_from_world.reshape(-1, 4, 4)
    planes = np.concatenate([rows[:, 3:] + rows[:, :3], rows[:, 3:] - rows[:, :3]], axis=1)  # >= 0 inside
    planes /= np.linalg.norm(planes[:, :, :3], axis=2, keepdims=True)
    visible = _reach(planes, centres, radii)
    if floor_height is not None and not visible.all():
        height = centres[:, 2:] - floor_height
        shadows = centres - np.hstack([_SLOPE * np.maximum(height, 0.0), height])
        visible |= _reach(planes, shadows, _STRETCH * radii)
    return visible


def _reach(planes: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return whether spheres are at least partly inside of all planes of a tile, for any tile; (N,)."""
    is_inside = planes[:, :, :3] @ centres.T + planes[:, :, 3:] >= -radii
    return np.asarray(is_inside.all(axis=1).any(axis=0))
