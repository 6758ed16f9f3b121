"""A script object of CoppeliaSim 4.9 and later: a child frame of the scripted object, for paths to the script."""

from __future__ import annotations

from typing import Literal

from drone_sim.context import SimulationContext
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place


class ScriptParameters(KindParameters):
    """A script object; the script itself is an entry of `scripts`, attached to this object's parent."""

    kind: Literal["script"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return SceneObject(*place, kind="script")
