"""Joints and force sensors, which can hold a shape; chains.py describes their part in the dynamics."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from drone_sim.config.types import Coordinate, Finite, ParameterError, Within, increasing
from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.joint import FORCE, POSITION, VELOCITY, Joint, JointControl
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.entry import KindParameters, Place
from drone_sim.world import World

_ZERO = (0.0, 0.0, 0.0)
_Limits = Annotated[
    tuple[Coordinate, Coordinate] | None,
    AfterValidator(increasing),
    Field(description="2 numbers, [lowest, highest] in rad or m"),
]


class JointParameters(KindParameters):
    """A joint that rotates about or moves along its z axis (rad or m); `limits` None: no limits."""

    kind: Literal["joint"]
    type: Literal["revolute", "prismatic", "spherical"]
    limits: _Limits = None
    value: Annotated[Finite, Within(-1e5, 1e5)] = 0.0  # rad or m
    mode: Literal["kinematic", "passive", "position", "velocity", "force"] = "kinematic"
    target: Annotated[Finite, Within(-1e9, 1e9)] = 0.0
    max_force: Annotated[Finite, Within(0, 1e9)] = 100.0  # N m or N

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError for a value outside the limits, and for a value or limits of a spherical joint."""
        super().model_post_init(context)
        low, high = self.limits or (-math.inf, math.inf)
        if not low <= self.value <= high:
            raise ParameterError(f"must be within the limits, {low:g} to {high:g}", ("value",), f"{self.value:g}")
        if self.type == "spherical" and (self.limits is not None or self.value):
            raise ParameterError(
                "limits, value: a spherical joint must not have them; turn it with setSphericalJointMatrix"
            )

    @property
    def control(self) -> JointControl:
        return JointControl(
            self.mode,
            position=self.target if self.mode == POSITION else self.value,
            velocity=self.target if self.mode == VELOCITY else 0.0,
            force=self.target if self.mode == FORCE else 0.0,
            max_force=self.max_force,
        )

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return Joint(*place, motion=self.type, limits=self.limits, value=self.value, control=self.control)


class ForceSensorParameters(KindParameters):
    """A force sensor: a rigid link between its child shape and its parent that measures the transmitted wrench."""

    kind: Literal["force_sensor"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return ForceSensor(*place, kind="force_sensor")


class ForceSensor(SceneObject):
    """Measures the force and torque transmitted to its child shape."""

    _held_link: tuple[World, int, int] | None = None

    def hold(self, world: World, body: int, link: int) -> None:
        self._held_link = world, body, link
        world.joints.measure(body, link)

    @property
    def is_held(self) -> bool:
        return self._held_link is not None

    def release(self) -> None:
        self._held_link = None

    def read(self) -> tuple[Vector, Vector]:
        """Return the force (N) and torque (N m) that the child exerts, of the last sub-step, in the sensor's frame."""
        if self._held_link is None:
            return _ZERO, _ZERO
        world, body, link = self._held_link
        return world.joints.load(body, link)
