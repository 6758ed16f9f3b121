"""A joint as an object of the scene: what hangs on it stands at world(joint) · motion(value) · local.

Revolute joints turn about their z axis (rad), prismatic ones slide along it (m), spherical ones turn any way.
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
    """What moves a joint: one of the modes above, its targets (rad or m, rad/s or m/s, N m or N), and its motor.

    `max_force` is the most that the motor gives in the modes position and velocity.
    """

    mode: str = KINEMATIC
    position: float = 0.0
    velocity: float = 0.0
    force: float = 0.0
    max_force: float = 0.0


class Drive(Protocol):
    """A joint in the dynamics."""

    def state(self) -> tuple[float, float, float]:
        """Return position (rad or m), velocity (rad/s or m/s), what its motor gave in the last sub-step (N m or N)."""

    def put(self, value: float) -> None:
        """Put it at a position, at rest."""

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Let it have other limits, rad or m, or none."""

    def command(self, control: JointControl) -> None:
        """Let its motor do from now on what is told; in the mode kinematic it stands still."""


class Joint(SceneObject):
    """A joint: where it is, and what moves it."""

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
        """Stand at `local` in the parent's frame; `motion` is one of the three, without `limits` it has no end."""
        super().__init__(names, alias, parent, local, kind="joint")
        self.motion = motion
        self.limits = limits
        self.drive: Drive | None = None  # where the dynamics moves it
        self.control = control
        self.dynamic_mode = control.mode if control.mode != KINEMATIC else PASSIVE  # the last one
        self.turn = IDENTITY  # of a spherical one
        self._value = value
        self._frame = self._moved = IDENTITY
        self._moved_by: tuple[float, Matrix] = (0.0, IDENTITY)

    # ---- where it is

    @property
    def value(self) -> float:
        """How far it is turned or slid, rad or m; within half a turn where it has no end."""
        value = self._value if self.drive is None else self.drive.state()[0]
        if self.motion == REVOLUTE and self.limits is None:
            return math.remainder(value, math.tau)
        return value

    @property
    def velocity_along(self) -> float:
        """How fast it moves, rad/s or m/s; 0 where the dynamics does not move it."""
        return 0.0 if self.drive is None else self.drive.state()[1]

    def place(self, value: float) -> None:
        """Put it at a position, rad or m, or at the end of its way."""
        if self.limits is not None:
            value = min(max(value, self.limits[0]), self.limits[1])
        self._value = value
        if self.drive is not None:
            self.drive.put(value)

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Let it have other limits, rad or m, or none."""
        self.limits = limits
        if self.drive is not None:
            self.drive.limit(limits)
        elif limits is not None:
            self.place(self._value)

    def release(self) -> None:
        """Be moved by the dynamics no longer, and stay as it stands."""
        self._value, self.drive = self.value, None

    def below(self) -> Matrix:
        """Return the transform world from the frame in which stands what hangs on it."""
        frame, moved_by = self.matrix(), (self.value, self.turn)
        if frame is not self._frame or moved_by != self._moved_by:
            self._frame, self._moved_by = frame, moved_by
            self._moved = frames.multiply(frame, self.motion_matrix())
        return self._moved

    def motion_matrix(self) -> Matrix:
        """Return the transform that its position makes, between its own frame and what hangs on it."""
        if self.motion == SPHERICAL:
            return self.turn
        value = self.value
        if self.motion == PRISMATIC:
            return frames.from_rpy((0.0, 0.0, value), (0.0, 0.0, 0.0))
        return frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, value))

    # ---- what moves it

    def command(self, control: JointControl) -> None:
        """Be controlled like that from now on; without a drive, it jumps to a target position at once."""
        before, self.control = self.control, control
        self.dynamic_mode = control.mode if control.mode != KINEMATIC else self.dynamic_mode
        if self.drive is not None:
            self.drive.command(control)
        elif control.position != before.position:
            self.place(control.position)

    def change(self, **changes: str | float) -> None:
        """Change some of what moves it."""
        self.command(replace(self.control, **changes))  # type: ignore[arg-type]

    def save_state(self) -> Restore:
        """Return a function that brings back what the dynamics does not: place, position and control."""
        own = saved(self, "_value", "turn", "control", "limits")
        return in_turn(super().save_state(), own, self._tell_drive)

    def _tell_drive(self) -> None:
        if self.drive is not None:
            self.drive.limit(self.limits)
            self.drive.command(self.control)
