"""A dummy: a frame, and nothing else."""

from __future__ import annotations

from typing import Literal

from drone_sim.config.types import Length
from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place


class DummyParameters(KindParameters):
    """A dummy; `size` (m) is that of the ball by which rviz shows it."""

    kind: Literal["dummy"]
    size: Length = 0.01

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the frame."""
        return Dummy(place, self.size)


class Dummy(SceneObject):
    """A frame, and how large it is shown."""

    def __init__(self, place: Place, size: float):
        """Take where it is, and its size (m)."""
        super().__init__(*place, kind="dummy")
        self.size = size
