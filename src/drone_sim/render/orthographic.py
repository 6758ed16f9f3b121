"""A camera whose rays are parallel, in the conventions of intrinsics.py."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drone_sim.render.intrinsics import Intrinsics


@dataclass(frozen=True)
class Orthographic:
    """A camera without perspective and with square pixels.

    width, height: pixels; wide: metres across the picture; near, far: metres along the optical z.
    Raises ValueError for a size or range with which no picture can be made.
    """

    width: int
    height: int
    wide: float
    near: float
    far: float

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size {self.width} x {self.height}: both must be at least 1")
        if not 0.0 < self.wide < math.inf:
            raise ValueError(f"wide {self.wide}: must be greater than 0 m")
        if not 0.0 < self.near < self.far < math.inf:
            raise ValueError(f"near {self.near}, far {self.far}: 0 < near < far is needed")

    @property
    def high(self) -> float:
        """Metres from the picture's top to its bottom."""
        return self.wide * self.height / self.width

    def projection(self) -> np.ndarray:
        """OpenGL clip matrix (4, 4) float64 of the optical frame, as Intrinsics.projection.

        Depth near..far maps to -1..1 as in glOrtho.
        """
        near, far = self.near, self.far
        clip = np.diag([2.0 / self.wide, 2.0 / self.high, 2.0 / (far - near), 1.0])
        clip[2, 3] = -(far + near) / (far - near)
        return clip


Lens = Intrinsics | Orthographic
