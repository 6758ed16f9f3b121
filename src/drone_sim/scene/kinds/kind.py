"""What an entry of `objects` is that is no shape: its keys, and the object that scripts find."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

from pydantic import Field

from drone_sim.config.types import Label, Point
from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.entry import EntryParameters, Place

__all__ = ["KindParameters", "Place"]


class KindParameters(EntryParameters):
    """What all kinds have in common that are no shapes."""

    name: Annotated[Label, Field(min_length=1)]
    position: Point = (0.0, 0.0, 0.0)
    kind: str

    @abstractmethod
    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the object."""
