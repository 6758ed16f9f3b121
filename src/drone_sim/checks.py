"""Commands from outside are checked before they reach the drone; what is refused says why in one line."""

from __future__ import annotations

import math
from typing import Sequence

from drone_sim.parameters import Parameters
from drone_sim.state import Pose, Twist, Vector3


class Refused(ValueError):
    """A command is a mistake; the message names the field, the value and what is allowed."""


def twist(linear: Sequence[float], angular: Sequence[float], parameters: Parameters) -> Twist:
    """Return the command (m/s, rad/s); raises Refused beyond cmd_vel_limits."""
    limits = parameters.cmd_vel_limits
    for kind, values, limit, unit in (
        ("linear", linear, limits.linear, "m/s"),
        ("angular", angular, limits.angular, "rad/s"),
    ):
        for axis, value in zip("xyz", values):
            if not abs(value) <= limit:
                raise Refused(f"{kind}.{axis} = {value}: must lie within +-{limit} {unit}")
    return Twist(Vector3(*linear), Vector3(*angular))


def pose(position: Sequence[float], orientation: Sequence[float], parameters: Parameters) -> Pose:
    """Return the pose (m, quaternion made exactly unit); raises Refused where nothing could stand."""
    limit = parameters.position_limit
    for axis, value, lowest in zip("xyz", position, (-limit, -limit, 0.0)):
        if not lowest <= value <= limit:
            raise Refused(f"position.{axis} = {value}: must lie within {lowest} and {limit} m")
    length = math.sqrt(sum(value * value for value in orientation))
    if not 0.99 < length < 1.01:
        raise Refused(f"orientation {tuple(orientation)}: must be a unit quaternion, its length is {length:.3g}")
    x, y, z, w = (value / length for value in orientation)
    return Pose((position[0], position[1], position[2]), (x, y, z, w))
