"""A force sensor: a rigid link between its child shape and its parent that measures the transmitted wrench."""

from __future__ import annotations

from typing import Literal

from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place
from drone_sim.world import World

_ZERO = (0.0, 0.0, 0.0)


class ForceSensorParameters(KindParameters):
    """A force sensor; chains.py describes its part in the dynamics."""

    kind: Literal["force_sensor"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the sensor, not attached to a link yet."""
        return ForceSensor(*place, kind="force_sensor")


class ForceSensor(SceneObject):
    """Measures the force and torque transmitted to its child shape."""

    _held_link: tuple[World, int, int] | None = None

    def hold(self, world: World, body: int, link: int) -> None:
        """Attach the sensor to the link of a body that it holds."""
        self._held_link = world, body, link
        world.joints.measure(body, link)

    @property
    def is_held(self) -> bool:
        """Whether it holds a shape in the dynamics."""
        return self._held_link is not None

    def release(self) -> None:
        """Detach the sensor from its link."""
        self._held_link = None

    def read(self) -> tuple[Vector, Vector]:
        """Return the force (N) and torque (N m) that the child exerts, of the last sub-step, in the sensor's frame."""
        if self._held_link is None:
            return _ZERO, _ZERO
        world, body, link = self._held_link
        return world.joints.load(body, link)
