"""A rigid shape of several shapes, in one body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.shapes.shape import Rgba, SceneShape, Shape

MAX_PARTS = 200


class Part(NamedTuple):
    """One of the shapes, in the frame of the whole, and its color."""

    shape: SceneShape
    local: Matrix
    color: Rgba


@dataclass(frozen=True)
class Compound(Shape):
    """Several shapes, each with its place and color."""

    word = "compound"

    of: tuple[Part, ...]

    def meshes(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Yield path and scale (x, y, z) of its parts' mesh files. Raises ValueError for one that cannot be read."""
        for part in self.of:
            yield from part.shape.meshes()


def parts_of(shape: SceneShape | Compound, color: Rgba) -> tuple[Part, ...]:
    """Return the parts of a compound, or the shape itself as the only part."""
    return shape.of if isinstance(shape, Compound) else (Part(shape, IDENTITY, color),)
