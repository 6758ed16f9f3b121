"""Poses as V-REP's files have them: seven numbers, quaternions w first."""

from __future__ import annotations

import math

from drone_sim.mechanics.state import Pose
from drone_sim.vrep_files.errors import VrepFileError
from drone_sim.vrep_files.model import ORIGIN


def quaternion_first(seven: tuple[float, ...] | None, tag: str) -> Pose:
    """Return an object's pose: w, x, y, z of a quaternion, then a position; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if seven is None else _pose(seven[4:7], seven[:4], tag)


def position_first(seven: tuple[float, ...] | None, tag: str) -> Pose:
    """Return a mesh's pose: a position, then w, x, y, z of a quaternion; ORIGIN for None. Raises VrepFileError."""
    return ORIGIN if seven is None else _pose(seven[:3], seven[3:7], tag)


def _pose(position: tuple[float, ...], quaternion: tuple[float, ...], tag: str) -> Pose:
    length = math.sqrt(sum(value * value for value in quaternion))
    if not 0.9 < length < 1.1:
        raise VrepFileError(f"{tag}: its quaternion has the length {length:.3g}, not 1")
    w, x, y, z = (value / length for value in quaternion)
    return Pose((position[0], position[1], position[2]), (x, y, z, w))
