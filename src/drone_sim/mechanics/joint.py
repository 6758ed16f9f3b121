"""A joint as an object of the scene: its children are at world(joint) · motion(value) · local.

Revolute joints rotate about their z axis (rad), prismatic joints slide along it (m), spherical joints rotate freely.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.scene_object import SceneObject

REVOLUTE, PRISMATIC, SPHERICAL = "revolute", "prismatic", "spherical"
KINEMATIC, PASSIVE, POSITION, VELOCITY, FORCE = "kinematic", "passive", "position", "velocity", "force"


@dataclass(frozen=True)
class JointControl:
    """How a joint is driven: one of the modes above, its targets (rad or m, rad/s or m/s, N m or N), its motor.

    `max_force` is the motor's largest force or torque in the modes position and velocity.
    """

    mode: str = KINEMATIC
    position: float = 0.0
    velocity: float = 0.0
    force: float = 0.0
    max_force: float = 0.0


class Drive(Protocol):
    """Interface of a joint in the dynamics; rad or m, N m or N."""

    def state(self) -> tuple[float, float, float]:
        """Return position, velocity (per s), and the motor's force or torque in the last sub-step."""

    def put(self, value: float) -> None:
        """Place the joint at a position, at rest."""

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Change the joint's limits, or remove them."""

    def command(self, control: JointControl) -> None:
        """Control the motor by `control` from now on; in the mode kinematic it holds the joint still."""


class Joint(SceneObject):
    """A joint: its position, and its control."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix,
        *,
        motion: str = REVOLUTE,
        limits: tuple[float, float] | None = None,
        value: float = 0.0,
        control: JointControl = JointControl(),
    ):
        """Create a joint at `local` in the parent's frame; `motion` is one of the three above, `limits` in rad or m."""
        super().__init__(names, alias, parent, local, kind="joint")
        self.motion = motion
        self.limits = limits
        self.drive: Drive | None = None  # None if the dynamics does not move it
        self.control = control
        self.dynamic_mode = control.mode if control.mode != KINEMATIC else PASSIVE  # the last mode but kinematic
        self.turn = IDENTITY  # rotation of a spherical joint
        self._value = value
        self._joint_frame = self._child_frame = IDENTITY
        self._motion_of_child: tuple[float, Matrix] = (0.0, IDENTITY)

    # ---- position

    @property
    def value(self) -> float:
        """Position, rad or m; without limits a revolute joint's is from -pi to pi."""
        value = self._value if self.drive is None else self.drive.state()[0]
        if self.motion == REVOLUTE and self.limits is None:
            return math.remainder(value, math.tau)
        return value

    @property
    def velocity_along(self) -> float:
        """Velocity, rad/s or m/s; 0 if the dynamics does not move the joint."""
        return 0.0 if self.drive is None else self.drive.state()[1]

    def place(self, value: float) -> None:
        """Set the position (rad or m), within the limits."""
        if self.limits is not None:
            value = min(max(value, self.limits[0]), self.limits[1])
        self._value = value
        if self.drive is not None:
            self.drive.put(value)

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Change the limits (rad or m), or remove them."""
        self.limits = limits
        if self.drive is not None:
            self.drive.limit(limits)
        elif limits is not None:
            self.place(self._value)

    def release(self) -> None:
        """Remove the joint from the dynamics; it keeps its position."""
        self._value, self.drive = self.value, None

    def below(self) -> Matrix:
        """Return the transform world from the frame that children are relative to."""
        frame, motion = self.matrix(), (self.value, self.turn)
        if frame is not self._joint_frame or motion != self._motion_of_child:
            self._joint_frame, self._motion_of_child = frame, motion
            self._child_frame = frames.multiply(frame, self.motion_matrix())
        return self._child_frame

    def motion_matrix(self) -> Matrix:
        """Return the transform of the position: the joint's frame from the frame of its children."""
        if self.motion == SPHERICAL:
            return self.turn
        value = self.value
        if self.motion == PRISMATIC:
            return frames.from_rpy((0.0, 0.0, value), (0.0, 0.0, 0.0))
        return frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, value))

    # ---- control

    def command(self, control: JointControl) -> None:
        """Set the control; without a drive the joint jumps to a new target position at once."""
        before, self.control = self.control, control
        self.dynamic_mode = control.mode if control.mode != KINEMATIC else self.dynamic_mode
        if self.drive is not None:
            self.drive.command(control)
        elif control.position != before.position:
            self.place(control.position)

    def change(self, **changes: str | float) -> None:
        """Change some fields of the control."""
        self.command(replace(self.control, **changes))  # type: ignore[arg-type]

    def save_state(self) -> Restore:
        """Return a function that restores parent, position, limits and control; the dynamics restores the rest."""
        joint_state = saved(self, "_value", "turn", "control", "limits")
        return in_turn(super().save_state(), joint_state, self._update_drive)

    def _update_drive(self) -> None:
        if self.drive is not None:
            self.drive.limit(self.limits)
            self.drive.command(self.control)
