"""Arrows of lines for rviz, which turns lines to who looks and lights them from everywhere; not so its own arrows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

_HEAD = 0.045  # m, how far back its barbs reach
_SHARE = 0.4  # of a short arrow
_SPREAD = 0.5  # how far aside they reach, for each metre back

Points = list[Sequence[float]]  # of lines, two by two


def arrow(start: np.ndarray, way: np.ndarray) -> Points:
    """Return the lines of an arrow from `start` along `way`, which is not 0 (m): its shaft, then four barbs."""
    length = float(np.linalg.norm(way))
    ahead, tip = way / length, start + way
    aside = np.cross(ahead, (1.0, 0.0, 0.0) if abs(ahead[0]) < 0.9 else (0.0, 1.0, 0.0))
    aside /= np.linalg.norm(aside)
    other = np.cross(ahead, aside)
    back = min(_HEAD, _SHARE * length)
    ends = [tip + back * (_SPREAD * one - ahead) for one in (aside, -aside, other, -other)]
    return _listed([start, tip, *(point for end in ends for point in (tip, end))])


def cross(middle: np.ndarray, half: float) -> Points:
    """Return the four diagonals of a cube with half a side so long (m): a cross from wherever it is seen."""
    corners = half * np.array([(1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1)])
    return _listed([point for corner in corners for point in (middle - corner, middle + corner)])


def _listed(points: Sequence[np.ndarray]) -> Points:
    rows: Any = np.array(points).tolist()
    return list(rows)
