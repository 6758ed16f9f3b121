"""A mesh as it is once it has been read, and how large one may be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drone_sim.files.resources import MEBIBYTE

KINDS = (".obj", ".stl", ".dae")
MAX_SIZE = 32 * MEBIBYTE  # bytes of a file, and of each that it names
MAX_TRIANGLES = 200_000  # of a file
MAX_PARTS = 256  # materials, or nodes of a COLLADA scene
MAX_COORDINATE = 1e6  # m from the mesh's origin
WHITE = (1.0, 1.0, 1.0, 1.0)
Colour = tuple[float, float, float, float]


class MeshPart(NamedTuple):
    """One material's triangles, in metres.

    vertices: (n, 3) float64; faces: (m, 3); uv: (n, 2), v upwards, or None; rgba: 0..1; texture: (h, w, 3 or 4)
    uint8, top row first, or None.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None
    rgba: Colour
    texture: np.ndarray | None

    @property
    def nbytes(self) -> int:
        """Memory that it takes."""
        return sum(one.nbytes for one in (self.vertices, self.faces, self.uv, self.texture) if one is not None)
