"""A neutral description of one thing to draw, shared by the world (which fills it) and the renderer."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from drone_sim.shapes.shape import DrawnShape, Rgba

GROUND = (0.47, 0.50, 0.44)  # colour of the bare ground around the floor


@dataclass(frozen=True)
class Visual:
    """One shape with its look, in its own frame; where it stands is given per frame, as a pose.

    key: identity, for example ``(body, index)``; a different Visual under a known key replaces it.
    rgba: 0..1, multiplied with what a mesh's own material says; white leaves the material as it is.
    texture: path of an image that replaces a mesh's own texture.
    edition: changes when the files of this visual have been written anew.
    floor: receives the shadows; a horizontal surface whose top is the top of its geometry.
    ground: what is around the floor, as far as one sees; receives the shadows, too.
    """

    key: Hashable
    shape: DrawnShape
    rgba: Rgba
    texture: str = ""
    edition: Hashable = None
    floor: bool = False
    ground: bool = False
