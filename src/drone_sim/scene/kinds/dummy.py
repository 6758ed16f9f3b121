"""A dummy: a frame without any other properties."""

from __future__ import annotations

from typing import Literal

from drone_sim.config.types import Length
from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place


class DummyParameters(KindParameters):
    """A dummy; `size` (m) is the diameter of its ball in rviz."""

    kind: Literal["dummy"]
    size: Length = 0.01

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return Dummy(place, self.size)


class Dummy(SceneObject):
    """A frame with a display size."""

    def __init__(self, place: Place, size: float):
        """Create the dummy; `size` in m."""
        super().__init__(*place, kind="dummy")
        self.size = size
