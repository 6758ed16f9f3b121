"""The sky: a dome of a few bands with a colour per vertex, so that a pixel costs only an interpolation.

It ends a little below the horizon: below it the ground has one colour, to which the image is cleared.
"""

from __future__ import annotations

import numpy as np

from drone_sim.shapes.visual import GROUND

SECTORS = 8
HAZE = GROUND  # colour of the distant ground, to which the image is cleared
# Elevation in degrees, and the colour there: the ground's haze brightens to the horizon, blue above it.
BANDS = (
    (-6.0, HAZE),
    (-0.6, (0.70, 0.72, 0.73)),
    (0.6, (0.85, 0.89, 0.93)),
    (6.0, (0.74, 0.83, 0.92)),
    (20.0, (0.56, 0.71, 0.88)),
    (45.0, (0.40, 0.59, 0.83)),
    (90.0, (0.30, 0.50, 0.78)),
)


def dome() -> np.ndarray:
    """Return triangles (m, 3, 6) float32: unit direction in the world and colour of each corner."""
    rings = []
    for elevation, colour in BANDS:
        up, around = np.radians(elevation), np.linspace(0.0, 2.0 * np.pi, SECTORS + 1)
        ring = np.empty((SECTORS + 1, 6))
        ring[:, 0], ring[:, 1] = np.cos(up) * np.cos(around), np.cos(up) * np.sin(around)
        ring[:, 2], ring[:, 3:] = np.sin(up), colour
        rings.append(ring)
    grid = np.array(rings)
    low, right, high, left = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    triangles = np.stack([low, right, high, low, high, left], axis=2)
    return triangles.reshape(-1, 3, 6).astype(np.float32)
