"""Parameters of the scene's objects, by the names of their constants: what getObjectInt32Param and the others mean.

Those of a shape, a joint, a vision sensor. A motor that is switched on without control runs at the target velocity,
with control it goes to the target position, as V-REP 3.x has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from drone_sim.mechanics.joint import KINEMATIC, PASSIVE, POSITION, VELOCITY, Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.vision import Eye

Getters = Mapping[str, Callable[[], float]]
Setters = Mapping[str, Callable[[float], None]]


@runtime_checkable
class Freezable(Protocol):
    """A shape of the scene that the dynamics may leave alone for a while."""

    @property
    def is_static(self) -> bool:
        """Whether it does."""

    def set_static(self, static: bool) -> None:
        """Let it. Raises ValueError."""


def readable(found: SceneObject) -> Getters:
    """Return what can be read of an object."""
    if isinstance(found, Joint):
        control = found.control
        return {
            "jointintparam_motor_enabled": lambda: control.mode not in (KINEMATIC, PASSIVE),
            "jointintparam_ctrl_enabled": lambda: control.mode == POSITION,
            "jointfloatparam_velocity": lambda: found.velocity_along,
            "jointfloatparam_upper_limit": lambda: found.limits[1] if found.limits else 0.0,
        }
    if isinstance(found, Eye):
        return {
            "visionintparam_resolution_x": lambda: found.width,
            "visionintparam_resolution_y": lambda: found.height,
            "visionfloatparam_near_clipping": lambda: found.near,
            "visionfloatparam_far_clipping": lambda: found.far,
            "visionfloatparam_perspective_angle": lambda: found.angle,
        }
    return {"shapeintparam_static": lambda: found.is_static} if isinstance(found, Freezable) else {}


def settable(found: SceneObject) -> Setters:
    """Return what can be set of an object."""
    if isinstance(found, Joint) and found.control.mode != KINEMATIC:
        mode = found.control.mode
        with_control = POSITION if mode == POSITION else VELOCITY
        return {
            "jointintparam_motor_enabled": lambda on: found.change(mode=with_control if on else PASSIVE),
            "jointintparam_ctrl_enabled": lambda on: found.change(mode=POSITION if on else _without(mode)),
        }
    if isinstance(found, Freezable):
        return {"shapeintparam_static": lambda static: found.set_static(bool(static))}
    return {}


def _without(mode: str) -> str:
    return VELOCITY if mode == POSITION else mode
