"""`sim`: poses, 7 numbers each: a position in m and a quaternion (x, y, z, w)."""

from __future__ import annotations

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.scripting.api.calls import numbers
from drone_sim.scripting.api.matrices import between, built, unit
from drone_sim.scripting.api.types import Number, Numbers, SevenNumbers, ThreeNumbers, TwelveNumbers


class Poses:
    """The functions on poses."""

    def buildPose(self, position: ThreeNumbers, angles: Numbers) -> list[float]:
        """Return the pose of a position and Euler angles, or a quaternion (x, y, z, w)."""
        return _pose(built(position, angles))

    def multiplyPoses(self, first: SevenNumbers, second: SevenNumbers) -> list[float]:
        """Return the pose first · second."""
        return _pose(frames.multiply(_matrix(first), _matrix(second)))

    def invertPose(self, pose: SevenNumbers) -> list[float]:
        """Return the pose that undoes another."""
        return _pose(frames.invert(_matrix(pose)))

    getPoseInverse = invertPose

    def interpolatePoses(self, first: SevenNumbers, second: SevenNumbers, part: Number) -> list[float]:
        """Return the pose so far (0 to 1) between two, the rotation on the shortest way."""
        return _pose(between(_matrix(first), _matrix(second), numbers((part,), 1)[0]))

    def poseToMatrix(self, pose: SevenNumbers) -> list[float]:
        """Return the 12 numbers of a pose's transform."""
        return list(_matrix(pose))

    def matrixToPose(self, matrix: TwelveNumbers) -> list[float]:
        """Return the pose of a transform's 12 numbers."""
        return _pose(numbers(matrix, 12))


def _matrix(pose: SevenNumbers) -> Matrix:
    values = numbers(pose, 7)
    return frames.from_quaternion(values[:3], unit(values[3:]))


def _pose(matrix: Matrix) -> list[float]:
    return [*frames.position(matrix), *frames.to_quaternion(matrix)]
