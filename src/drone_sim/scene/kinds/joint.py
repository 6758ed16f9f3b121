"""A joint of the scene; chains.py describes its part in the dynamics."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from drone_sim.config.types import Coordinate, Finite, ParameterError, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics.joint import FORCE, POSITION, VELOCITY, Joint, JointControl
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place

_Value = Annotated[Finite, Within(-1e5, 1e5)]  # rad or m
_Force = Annotated[Finite, Within(0, 1e9)]  # N m or N
_DEFAULT_FORCE = 100.0


def _check_order(pair: tuple[float, float] | None) -> tuple[float, float] | None:
    if pair is not None and not pair[0] < pair[1]:
        raise ValueError("must be [lowest, highest] with lowest < highest")
    return pair


_Limits = Annotated[
    tuple[Coordinate, Coordinate] | None,
    AfterValidator(_check_order),
    Field(description="2 numbers, [lowest, highest] in rad or m"),
]


class JointParameters(KindParameters):
    """A joint that rotates about or moves along its z axis (rad or m); `limits` None: no limits."""

    kind: Literal["joint"]
    type: Literal["revolute", "prismatic", "spherical"]
    limits: _Limits = None
    value: _Value = 0.0
    mode: Literal["kinematic", "passive", "position", "velocity", "force"] = "kinematic"
    target: Annotated[Finite, Within(-1e9, 1e9)] = 0.0
    max_force: _Force = _DEFAULT_FORCE

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
        """Its initial control mode and targets."""
        return JointControl(
            self.mode,
            position=self.target if self.mode == POSITION else self.value,
            velocity=self.target if self.mode == VELOCITY else 0.0,
            force=self.target if self.mode == FORCE else 0.0,
            max_force=self.max_force,
        )

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the joint, not moved by the dynamics yet."""
        return Joint(*place, motion=self.type, limits=self.limits, value=self.value, control=self.control)
