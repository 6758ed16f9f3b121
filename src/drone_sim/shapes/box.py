"""A box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Length
from drone_sim.shapes.shape import Files, Geometry, Primitive, ReportedShape, SceneShape, Triangles


def _unit_box() -> tuple[np.ndarray, np.ndarray]:
    """Return corners (12, 3, 3) and uv (12, 3, 2); each side shows the texture upright (z up) from outside."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # counter-clockwise
    sides = [
        np.roll(np.insert(square[::sign], 0, sign / 2, axis=1), axis, axis=1)
        for axis, sign in product(range(3), (1, -1))
    ]
    corners = np.array([side[list(half)] for side in sides for half in ((0, 1, 2), (0, 2, 3))])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(normals).argmax(axis=1)
    sign = np.sign(normals[np.arange(len(normals)), axis])
    x, y, z = np.moveaxis(corners, 2, 0)
    side = sign[:, None]
    right = np.choose(axis[:, None], [side * y, -side * x, x])
    up = np.choose(axis[:, None], [z, z, side * y])
    return corners, np.stack([right, up], axis=2) + 0.5


_CORNERS, _UV = _unit_box()
# Triangles, because rviz draws them in the given colours. Its only light is at the viewpoint and leaves sides black.
_FOR_RVIZ = tuple((float(x), float(y), float(z)) for x, y, z in _CORNERS.reshape(-1, 3))


@dataclass(frozen=True)
class Box(SceneShape, ReportedShape):
    """A box; `size` is its length, width and height."""

    word = "box"
    bullet_type = "GEOM_BOX"
    has_uv = True  # the whole texture on each side

    size: Annotated[tuple[Length, Length, Length], Field(description="3 numbers, [length, width, height] in m")]

    def for_bullet(self, files: Files, moves: bool) -> Geometry:
        """Return the geometry, by half lengths."""
        half = {"halfExtents": [length / 2 for length in self.size]}
        return Geometry(self.bullet_type, half, half)

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Box:
        length, width, height = dimensions
        return cls((length, width, height))

    def triangles(self) -> tuple[Triangles]:
        return (Triangles(_CORNERS * np.asarray(self.size), _UV),)

    def shared(self) -> tuple[Box, tuple[float, float, float]]:
        return Box((1.0, 1.0, 1.0)), self.size

    def for_rviz(self) -> tuple[Primitive]:
        return (Primitive("triangles", self.size, corners=_FOR_RVIZ),)
