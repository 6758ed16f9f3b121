"""Boxes for rviz in the light of the cameras' sun: rviz's own lamp is carried by who looks, and leaves sides black."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.render.renderer import TO_SUN

_SUN = np.array(TO_SUN) / np.linalg.norm(TO_SUN)
_FROM_BELOW, _FROM_ABOVE, _FROM_SUN = np.array([(0.42, 0.41, 0.40), (0.52, 0.54, 0.57), (0.54, 0.52, 0.48)])
_SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))  # normals


def _corners() -> list[Point]:
    """Return the triangles of a box of 1 m, two for each of _SIDES."""
    points = []
    for normal in np.array(_SIDES, dtype=float):
        right = np.roll(normal, 1)
        up = np.cross(normal, right)
        for across, along in ((-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)):
            points.append(Point(*(0.5 * (normal + across * right + along * up))))
    return points


_POINTS = _corners()


def paint(marker: Marker, matrix: frames.Matrix, rgba: Sequence[float]) -> None:
    """Make a marker at `matrix`, as large as its scale says, a box of this colour."""
    marker.type, marker.points = Marker.TRIANGLE_LIST, _POINTS
    for normal in _SIDES:
        red, green, blue = np.minimum(light(frames.rotate(matrix, normal)) * rgba[:3], 1.0)
        marker.colors += [ColorRGBA(red, green, blue, rgba[3])] * 6


def light(normal: tuple[float, float, float]) -> np.ndarray:
    """Return what a surface with this normal (world) gets of red, green and blue: as in the cameras' shaders."""
    share = 0.5 + 0.5 * normal[2]
    ambient = (1 - share) * _FROM_BELOW + share * _FROM_ABOVE
    return np.asarray(ambient + _FROM_SUN * max(0.85 * float(_SUN @ normal) + 0.15, 0.0))
