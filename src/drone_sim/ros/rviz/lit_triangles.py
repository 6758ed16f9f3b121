"""Triangles for rviz in the cameras' sun: rviz's own lamp is carried by who looks, and leaves sides black."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics.frames import Matrix
from drone_sim.render.renderer import TO_SUN
from drone_sim.shapes.primitive import Corner

_SUN = np.array(TO_SUN) / np.linalg.norm(TO_SUN)
_FROM_BELOW, _FROM_ABOVE, _FROM_SUN = np.array([(0.42, 0.41, 0.40), (0.52, 0.54, 0.57), (0.54, 0.52, 0.48)])


def paint(marker: Marker, corners: tuple[Corner, ...], matrix: Matrix, rgba: Sequence[float]) -> None:
    """Make a marker at `matrix`, as large as its scale says, these triangles (three corners each, m) of this colour."""
    points, normals = _triangles(corners)
    scale = marker.scale.x, marker.scale.y, marker.scale.z
    marker.type, marker.points = Marker.TRIANGLE_LIST, points
    colors: Any = np.minimum(_light(normals / scale, matrix) * rgba[:3], 1.0).tolist()
    for red, green, blue in colors:
        marker.colors += [ColorRGBA(red, green, blue, rgba[3])] * 3


@lru_cache
def _triangles(corners: tuple[Corner, ...]) -> tuple[list[Point], np.ndarray]:
    """Return the corners as rviz wants them, and the triangles' normals (m, 3), of any length."""
    first, second, third = np.moveaxis(np.reshape(corners, (-1, 3, 3)), 1, 0)
    return [Point(*corner) for corner in corners], np.cross(second - first, third - first)


def _light(normals: np.ndarray, matrix: Matrix) -> np.ndarray:
    """Return what surfaces with these normals (m, 3) get of red, green and blue: as in the cameras' shaders."""
    turned = normals @ np.reshape(matrix, (3, 4))[:, :3].T
    turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30)
    share = 0.5 + 0.5 * turned[:, 2:]
    ambient = (1 - share) * _FROM_BELOW + share * _FROM_ABOVE
    return np.asarray(ambient + _FROM_SUN * np.maximum(0.85 * (turned @ _SUN)[:, None] + 0.15, 0.0))
