"""`sim`: products of matrices, 12 numbers each."""

from __future__ import annotations

from drone_sim.mechanics import frames
from drone_sim.scripting.api.calls import numbers
from drone_sim.scripting.api.types import ThreeNumbers, TwelveNumbers


class Matrices:
    """The functions on matrices."""

    def multiplyVector(self, matrix: TwelveNumbers, vector: ThreeNumbers) -> list[float]:
        """Return matrix · vector."""
        m, v = numbers(matrix, 12), numbers(vector, 3)
        return list(frames.transform(m, v))

    def multiplyMatrices(self, first: TwelveNumbers, second: TwelveNumbers) -> list[float]:
        """Return first · second."""
        return list(frames.multiply(numbers(first, 12), numbers(second, 12)))

    def buildMatrix(self, position: ThreeNumbers, angles: ThreeNumbers) -> list[float]:
        """Return the transform of a position and Euler angles."""
        return list(frames.from_euler(numbers(position, 3), numbers(angles, 3)))

    def getEulerAnglesFromMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Return the Euler angles of a transform."""
        return list(frames.to_euler(numbers(matrix, 12)))

    def getMatrixInverse(self, matrix: TwelveNumbers) -> list[float]:
        """Return the inverse of a transform."""
        return list(frames.invert(numbers(matrix, 12)))

    def getInvertedMatrix(self, matrix: TwelveNumbers) -> list[float]:
        """Return the inverse of a transform (3.x)."""
        return list(frames.invert(numbers(matrix, 12)))
