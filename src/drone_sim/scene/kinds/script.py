"""A script of CoppeliaSim 4.9 and later as an object: a frame below what it is on, by which paths find it."""

from __future__ import annotations

from typing import Literal

from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place


class ScriptParameters(KindParameters):
    """A script object; the script itself is an entry of `scripts`, on the object that this one hangs on."""

    kind: Literal["script"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the frame."""
        return SceneObject(*place, kind="script")
