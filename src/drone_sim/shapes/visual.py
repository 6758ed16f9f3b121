"""A neutral description of a visual, which the world creates and the renderer draws."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from drone_sim.shapes.shape import DrawnShape, Rgba

GROUND = (0.47, 0.50, 0.44)  # colour of the bare ground around the floor


@dataclass(frozen=True)
class Visual:
    """A shape and its appearance, in its own frame; its pose is given separately for each picture.

    key: identity, for example ``(body, index)``; a different Visual with a known key replaces it.
    rgba: 0..1, multiplied with a mesh's own material; white leaves the material unchanged.
    texture: path of an image that replaces a mesh's own texture.
    edition: changes when the files of this visual have been written again.
    floor: receives the shadows; a horizontal surface at the top of its geometry.
    ground: the surroundings of the floor, as far as cameras see; receives the shadows, too.
    """

    key: Hashable
    shape: DrawnShape
    rgba: Rgba
    texture: str = ""
    edition: Hashable = None
    floor: bool = False
    ground: bool = False
