"""A force sensor: a rigid link between the shape on it and what it hangs on, which measures what goes through."""

from __future__ import annotations

from typing import Literal

from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place
from drone_sim.world import World

_NOTHING = (0.0, 0.0, 0.0)


class ForceSensorParameters(KindParameters):
    """A force sensor; what the dynamics makes of it is in chains.py."""

    kind: Literal["force_sensor"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the sensor, which holds nothing yet."""
        return ForceSensor(*place, kind="force_sensor")


class ForceSensor(SceneObject):
    """Tells what goes through it."""

    _held: tuple[World, int, int] | None = None

    def hold(self, world: World, body: int, link: int) -> None:
        """Hold a link of a body in the world."""
        self._held = world, body, link
        world.joints.measure(body, link)

    @property
    def is_held(self) -> bool:
        """Whether something hangs on it in the dynamics."""
        return self._held is not None

    def release(self) -> None:
        """Hold nothing any more."""
        self._held = None

    def read(self) -> tuple[Vector, Vector]:
        """Return force (N) and torque (N m), as of the last sub-step, by which what hangs on it acts; its own frame."""
        if self._held is None:
            return _NOTHING, _NOTHING
        world, body, link = self._held
        return world.joints.load(body, link)
