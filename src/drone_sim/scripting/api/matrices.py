"""`sim`: matrices of 12 numbers, poses of 7 numbers, and rotations.

Interpolation rotates about a fixed axis at constant speed: K. Shoemake, Animating Rotation with Quaternion Curves,
1985.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Quaternion, Vector
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.types import (
    FourNumbers,
    Number,
    Numbers,
    SevenNumbers,
    ThreeNumbers,
    TwelveNumbers,
    WrongValue,
    numbers,
)

_MOST_POINTS = 100_000


class Matrices:
    """Matrices, 12 numbers each, and rotations."""

    @sim("345")
    def multiplyVector(self, matrix: Numbers, vector: Numbers) -> list[float]:
        """Return matrix · vector, for one vector or for a list of several.

        `matrix` may be a pose (7 numbers), or a quaternion (x, y, z, w).
        """
        m = numbers(matrix, 12) if len(matrix) == 12 else _transform(matrix)
        if len(vector) == 3:
            return list(frames.transform(m, numbers(vector, 3)))
        values = numbers(vector, len(vector))
        if not values or len(values) % 3 or len(values) > 3 * _MOST_POINTS:
            raise WrongValue("expected 3 numbers, or 3 for each of several points")
        points = (values[index : index + 3] for index in range(0, len(values), 3))
        return [coordinate for point in points for coordinate in frames.transform(m, point)]

    @sim("345")
    def multiplyMatrices(self, first: TwelveNumbers, second: TwelveNumbers) -> list[float]:
        """Return first · second."""
        return list(frames.multiply(numbers(first, 12), numbers(second, 12)))

    @sim("345")
    def buildIdentityMatrix(self) -> list[float]:
        """Return the identity transform."""
        return list(IDENTITY)

    @sim("345")
    def copyMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Return a copy of a transform."""
        return list(numbers(matrix, 12))

    @sim("345")
    def buildMatrix(self, position: ThreeNumbers, angles: Numbers) -> list[float]:
        """Return the transform of a position and Euler angles, or a quaternion (x, y, z, w)."""
        return list(built(position, angles))

    @sim("345")
    def buildMatrixQ(self, position: ThreeNumbers, quaternion: FourNumbers) -> list[float]:
        """Return the transform of a position and a quaternion (x, y, z, w)."""
        return list(frames.from_quaternion(numbers(position, 3), unit(numbers(quaternion, 4))))

    @sim("345")
    def getEulerAnglesFromMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Return the Euler angles of a transform."""
        return list(frames.to_euler(numbers(matrix, 12)))

    @sim("345")
    def getQuaternionFromMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Return the quaternion (x, y, z, w) of a transform."""
        return list(frames.to_quaternion(numbers(matrix, 12)))

    @sim("5", getInvertedMatrix="3")
    def getMatrixInverse(self, matrix: TwelveNumbers) -> list[float]:
        """Return the inverse of a transform."""
        return list(frames.invert(numbers(matrix, 12)))

    @sim("345")
    def invertMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Invert a transform in place, in the given table, and return it."""
        inverse = list(frames.invert(numbers(matrix, 12)))
        if isinstance(matrix, list):
            matrix[:] = inverse
        return inverse

    @sim("345")
    def interpolateMatrices(self, first: TwelveNumbers, second: TwelveNumbers, part: Number) -> list[float]:
        """Return the transform at a fraction (0 to 1) between two, with the shortest rotation."""
        return list(between(numbers(first, 12), numbers(second, 12), numbers((part,), 1)[0]))

    @sim("345")
    def getRotationAxis(self, start: TwelveNumbers, goal: TwelveNumbers) -> tuple[list[float], float]:
        """Return axis (world) and angle (rad) of the rotation between two transforms."""
        turn = frames.multiply(numbers(goal, 12), frames.invert(numbers(start, 12)))
        axis, angle = axis_and_angle(frames.to_quaternion(turn))
        return list(axis), angle

    @sim("345")
    def rotateAroundAxis(
        self, matrix: Numbers, axis: ThreeNumbers, position: ThreeNumbers, angle: Number
    ) -> list[float]:
        """Return a transform, or a pose, rotated by an angle (rad) about an axis (world) through a position."""
        if len(matrix) == 7:
            return to_pose(self.rotateAroundAxis(from_pose(matrix), axis, position, angle))
        there = numbers(position, 3)
        turn = frames.from_quaternion((0.0, 0.0, 0.0), about(numbers(axis, 3), numbers((angle,), 1)[0]))
        x, y, z = frames.rotate(turn, there)
        r0, r1, r2, _, r4, r5, r6, _, r8, r9, r10, _ = turn
        placed = (r0, r1, r2, there[0] - x, r4, r5, r6, there[1] - y, r8, r9, r10, there[2] - z)
        return list(frames.multiply(placed, numbers(matrix, 12)))

    @sim("45")
    def alphaBetaGammaToYawPitchRoll(self, alpha: Number, beta: Number, gamma: Number) -> tuple[float, float, float]:
        """Return yaw, pitch and roll (R = Rz Ry Rx) of V-REP's Euler angles, in rad."""
        roll, pitch, yaw = frames.to_rpy(frames.from_euler((0.0, 0.0, 0.0), numbers((alpha, beta, gamma), 3)))
        return yaw, pitch, roll

    @sim("45")
    def yawPitchRollToAlphaBetaGamma(self, yaw: Number, pitch: Number, roll: Number) -> tuple[float, float, float]:
        """Return V-REP's Euler angles of yaw, pitch and roll (R = Rz Ry Rx), in rad."""
        return frames.to_euler(frames.from_rpy((0.0, 0.0, 0.0), numbers((roll, pitch, yaw), 3)))


def _transform(values: Numbers) -> Matrix:
    """Return the transform of a pose (7 numbers), of a quaternion (4), or of 12 numbers."""
    if len(values) == 4:
        return built((0.0, 0.0, 0.0), values)
    return built(values[:3], values[3:]) if len(values) == 7 else numbers(values, 12)


def built(position: Sequence[float], turn: Sequence[float]) -> Matrix:
    """Return the transform of a position and Euler angles (3 numbers) or a quaternion (4)."""
    if len(turn) == 4:
        return frames.from_quaternion(numbers(position, 3), unit(numbers(turn, 4)))
    return frames.from_euler(numbers(position, 3), numbers(turn, 3))


def unit(quaternion: Sequence[float]) -> Quaternion:
    """Return a quaternion scaled to length 1. Raises WrongValue for zero."""
    length = math.sqrt(sum(value * value for value in quaternion))
    if length == 0:
        raise WrongValue("expected a quaternion that is not zero")
    x, y, z, w = (value / length for value in quaternion)
    return x, y, z, w


def axis_and_angle(quaternion: Quaternion) -> tuple[Vector, float]:
    """Return axis and angle (rad) of a unit quaternion; the z axis without a rotation."""
    x, y, z, w = quaternion
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0:
        return (0.0, 0.0, 1.0), 0.0
    return (x / length, y / length, z / length), 2 * math.atan2(length, w)


def about(axis: Sequence[float], angle: float) -> Quaternion:
    """Return the quaternion of a rotation about an axis by an angle (rad). Raises WrongValue for a zero axis."""
    length = math.sqrt(sum(value * value for value in axis))
    if length == 0:
        raise WrongValue("expected an axis that is not zero")
    s = math.sin(angle / 2) / length
    return axis[0] * s, axis[1] * s, axis[2] * s, math.cos(angle / 2)


def between(first: Matrix, second: Matrix, part: float) -> Matrix:
    """Return the transform at a fraction (0 to 1) between two."""
    turn = frames.multiply(frames.invert(first), second)
    axis, angle = axis_and_angle(frames.to_quaternion(turn))
    orientation = frames.multiply_quaternions(frames.to_quaternion(first), about(axis, part * angle))
    place = [a + part * (b - a) for a, b in zip(frames.position(first), frames.position(second))]
    return frames.from_quaternion(place, orientation)


class Poses:
    """Poses, 7 numbers each: a position in m and a quaternion (x, y, z, w)."""

    @sim("5")
    def buildPose(self, position: ThreeNumbers, angles: Numbers) -> list[float]:
        """Return the pose of a position and Euler angles, or a quaternion (x, y, z, w)."""
        return to_pose(built(position, angles))

    @sim("5")
    def multiplyPoses(self, first: SevenNumbers, second: SevenNumbers) -> list[float]:
        """Return the pose first · second."""
        return to_pose(frames.multiply(from_pose(first), from_pose(second)))

    @sim("5", getPoseInverse="5")
    def invertPose(self, pose: SevenNumbers) -> list[float]:
        """Return the inverse of a pose."""
        return to_pose(frames.invert(from_pose(pose)))

    @sim("5")
    def interpolatePoses(self, first: SevenNumbers, second: SevenNumbers, part: Number) -> list[float]:
        """Return the pose at a fraction (0 to 1) between two, with the shortest rotation."""
        return to_pose(between(from_pose(first), from_pose(second), numbers((part,), 1)[0]))

    @sim("5")
    def poseToMatrix(self, pose: SevenNumbers) -> list[float]:
        """Return the 12 numbers of a pose's transform."""
        return list(from_pose(pose))

    @sim("5")
    def matrixToPose(self, matrix: TwelveNumbers) -> list[float]:
        """Return the pose of a transform's 12 numbers."""
        return to_pose(numbers(matrix, 12))


def from_pose(pose: SevenNumbers) -> Matrix:
    values = numbers(pose, 7)
    return frames.from_quaternion(values[:3], unit(values[3:]))


def to_pose(matrix: Sequence[float]) -> list[float]:
    return [*frames.position(matrix), *frames.to_quaternion(matrix)]
