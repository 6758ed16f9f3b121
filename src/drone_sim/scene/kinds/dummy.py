"""A dummy: a frame, and nothing else."""

from __future__ import annotations

from typing import Literal

from drone_sim.config.types import Length
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import Around, KindParameters, Place


class DummyParameters(KindParameters):
    """A dummy; `size` (m) is that of the ball by which rviz shows it."""

    kind: Literal["dummy"]
    size: Length = 0.01

    def make(self, place: Place, around: Around) -> SceneObject:
        """Return the frame."""
        return SceneObject(*place, kind="dummy")
