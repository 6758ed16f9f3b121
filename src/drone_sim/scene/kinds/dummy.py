"""A dummy: a frame, which may be linked to another dummy."""

from __future__ import annotations

from typing import Literal

from drone_sim.config.types import Label, Length
from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place


class DummyParameters(KindParameters):
    """A dummy; `size` (m) is the diameter of its ball in rviz.

    `linked`: name of another dummy; the dynamics keeps the bodies that carry the two rigidly together.
    """

    kind: Literal["dummy"]
    size: Length = 0.01
    linked: Label = ""

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return Dummy(place, self.size)


class Dummy(SceneObject):
    """A frame with a display size."""

    def __init__(self, place: Place, size: float):
        """Create the dummy; `size` in m."""
        super().__init__(*place, kind="dummy")
        self.size = size
