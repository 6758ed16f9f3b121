"""Checks of external commands before they reach the vehicle; each raises Refused with a message of one line."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drone_sim.forces.pushes import Push
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.vehicles.parameters import EquipmentParameters


class Refused(ValueError):
    """A command was refused; the message names the field, the value and what is allowed."""

    def __init__(self, message: str, field: str = ""):
        """Create the error; `field` is the field of the command that it is about."""
        super().__init__(message)
        self.field = field


def twist(linear: Sequence[float], angular: Sequence[float], parameters: EquipmentParameters) -> Twist:
    """Return the velocity command (m/s, rad/s). Raises Refused if it exceeds cmd_vel_limits."""
    _check_within("linear", linear, parameters.cmd_vel_limits.linear, "m/s")
    _check_within("angular", angular, parameters.cmd_vel_limits.angular, "rad/s")
    return Twist(Vector3(*linear), Vector3(*angular))


def push(force: Sequence[float], torque: Sequence[float], parameters: EquipmentParameters) -> Push:
    """Return a push (N, N m) of the configured duration. Raises Refused if it exceeds the limits."""
    limits = parameters.push
    _check_within("force", force, limits.force_limit, "N")
    _check_within("torque", torque, limits.torque_limit, "N m")
    return Push((force[0], force[1], force[2]), (torque[0], torque[1], torque[2]), limits.duration)


def pose(
    position: Sequence[float], orientation: Sequence[float], parameters: EquipmentParameters, lowest: float = 0.0
) -> Pose:
    """Return the pose (m, normalised quaternion).

    Raises Refused for a position outside position_limit or below `lowest`, or a quaternion that is not unit.
    """
    limit = parameters.position_limit
    for axis, value, minimum in zip("xyz", position, (-limit, -limit, lowest)):
        if not minimum <= value <= limit:
            raise Refused(f"position.{axis} = {value}: must lie between {minimum} and {limit} m", "position")
    length = math.sqrt(sum(value * value for value in orientation))
    if not 0.99 < length < 1.01:
        expected = f"must be a unit quaternion, its length is {length:.3g}"
        raise Refused(f"orientation {tuple(orientation)}: {expected}", "orientation")
    x, y, z, w = (value / length for value in orientation)
    return Pose((position[0], position[1], position[2]), (x, y, z, w))


def _check_within(kind: str, values: Sequence[float], limit: float, unit: str) -> None:
    for axis, value in zip("xyz", values):
        if not abs(value) <= limit:  # written this way, it also refuses NaN
            raise Refused(f"{kind}.{axis} = {value}: must lie within +-{limit} {unit}", kind)
