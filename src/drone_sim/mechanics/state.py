"""The state of a drone, and commands to it: immutable values in SI units."""

from __future__ import annotations

from typing import NamedTuple

from drone_sim.mechanics.frames import (
    Matrix,
    Quaternion,
    Vector,
    from_quaternion,
    invert,
    multiply_quaternions,
    position,
    to_quaternion,
    transform,
)

UNTURNED: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """A body's position (m) and orientation (unit quaternion x, y, z, w) in the world."""

    position: Vector
    orientation: Quaternion = UNTURNED

    @classmethod
    def of(cls, matrix: Matrix) -> Pose:
        """Return the pose of a transform."""
        return cls(position(matrix), to_quaternion(matrix))

    @property
    def matrix(self) -> Matrix:
        """The transform, as V-REP's 12 numbers."""
        return from_quaternion(self.position, self.orientation)


def compose(a: Pose, b: Pose) -> Pose:
    """Return pose `b`, which is relative to pose `a`, in the frame of reference of `a`."""
    return Pose(transform(a.matrix, b.position), multiply_quaternions(a.orientation, b.orientation))


def inverse(pose: Pose) -> Pose:
    x, y, z, w = pose.orientation
    return Pose(position(invert(pose.matrix)), (-x, -y, -z, w))


class State(NamedTuple):
    """Pose and velocity of a body's frame, in the world frame (m, m/s, rad/s)."""

    position: Vector
    orientation: Quaternion
    linear_velocity: Vector
    angular_velocity: Vector

    @property
    def matrix(self) -> Matrix:
        """The transform world from body, as V-REP's 12 numbers."""
        return from_quaternion(self.position, self.orientation)


class Vector3(NamedTuple):
    """Three numbers with the field names of geometry_msgs/Vector3."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Twist(NamedTuple):
    """A velocity command with the field names of geometry_msgs/Twist (m/s and rad/s, track frame)."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()
