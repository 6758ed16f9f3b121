"""What an entry of `objects` is that is no shape: its keys, and the object that scripts find."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import Label, Point
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.render.orthographic import Lens
from drone_sim.scene.entry import EntryParameters, Place
from drone_sim.world import World

__all__ = ["Around", "KindParameters", "Look", "Place"]

Look = Callable[[str, Lens, Matrix], np.ndarray]


@dataclass(frozen=True)
class Around:
    """What is around an object: the world, what takes pictures of it, and what scripts call a link of a body.

    `look` takes "color" or "depth", a camera, and the pose world from its optical frame; see sensors.camera.Vision.
    `follow` puts everything to where its parent has gone.
    """

    world: World
    look: Look
    name_of: Callable[[int, int], str]
    follow: Callable[[], None]


class KindParameters(EntryParameters):
    """What all kinds have in common that are no shapes."""

    name: Annotated[Label, Field(min_length=1)]
    position: Point = (0.0, 0.0, 0.0)
    kind: str

    @abstractmethod
    def make(self, place: Place, around: Around) -> SceneObject:
        """Return the object."""
