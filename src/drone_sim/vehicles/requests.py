"""What a vehicle may be asked for besides a twist, with the field names of the messages that ask for it."""

from __future__ import annotations

from typing import Any, NamedTuple

from drone_sim.mechanics.state import Pose, Vector3

EMPTY, POSE = "std_msgs/Empty", "geometry_msgs/PoseStamped"
RESET = "reset"
REQUESTS = {RESET: EMPTY, "takeoff": EMPTY, "land": EMPTY, "home": EMPTY, "goto": POSE}  # topics, and their types


class Empty(NamedTuple):
    """std_msgs/Empty."""


class Quaternion(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class PoseFields(NamedTuple):
    """geometry_msgs/Pose: m, and a unit quaternion."""

    position: Vector3
    orientation: Quaternion


class PoseStamped(NamedTuple):
    """geometry_msgs/PoseStamped, in the frame world, without its header."""

    pose: PoseFields


def request(pose: Pose | None = None) -> Any:
    """Return the message that a script gets: of a pose (world), or an empty one."""
    if pose is None:
        return Empty()
    return PoseStamped(PoseFields(Vector3(*pose.position), Quaternion(*pose.orientation)))
