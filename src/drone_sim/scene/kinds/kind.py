"""Base class of the entries of `objects` that are not shapes: their keys, and how their object is made."""

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
    """The keys that all kinds have in common."""

    name: Annotated[Label, Field(min_length=1)]
    position: Point = (0.0, 0.0, 0.0)
    kind: str

    @abstractmethod
    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the object."""
