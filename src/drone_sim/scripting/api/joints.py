"""`sim`: joints. Revolute joints are in rad, rad/s and N m, prismatic joints in m, m/s and N.

A propeller's joint has a position, which is the angle of the visible blades. Its targets are accepted and ignored,
because the thrust model turns the blades.
"""

from __future__ import annotations

import math
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.joint import FORCE, KINEMATIC, PRISMATIC, REVOLUTE, SPHERICAL, Joint
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.matrices import to_pose
from drone_sim.scripting.api.types import Handle, Number, Numbers, TwelveNumbers, WrongValue, numbers

_TYPES = {REVOLUTE: 10, PRISMATIC: 11, SPHERICAL: 12}  # sim.joint_revolute_subtype and so on
_KINEMATIC_MODE, _DYNAMIC_MODE = 0, 5  # sim.jointmode_kinematic, _dynamic (3.x: _passive, _force)
_CYCLIC = (-math.pi, math.tau)  # lowest position and range of a cyclic joint, as in V-REP
_TOLERANCE = 1e-3  # of the elements of a rotation matrix


class JointFunctions(Functions):
    """Joints: revolute joints in rad, rad/s and N m, prismatic joints in m, m/s and N."""

    # ---- positions and velocities

    @sim("345")
    def getJointPosition(self, handle: Handle) -> float:
        """Return the position of a joint; for a propeller's joint, the angle of the blades."""
        found = self._objects[handle]
        return found.value if isinstance(found, Joint) else self._host.turn_joint(found.name, None)

    @sim("345")
    def setJointPosition(self, handle: Handle, position: Number) -> None:
        """Set the position of a joint, within its limits; for a propeller's joint, turn the shown blades."""
        (value,) = numbers((position,), 1)
        found = self._objects[handle]
        if isinstance(found, Joint):
            self._linear_joint(handle).place(value)
        else:
            self._host.turn_joint(found.name, value)

    @sim("45")
    def getJointVelocity(self, handle: Handle) -> float:
        """Return the velocity of a joint that the dynamics moves."""
        return self._joint(handle).velocity_along

    @sim("345", getSphericalJointMatrix="")
    def getJointMatrix(self, handle: Handle) -> list[float]:
        """Return the transform between a joint's own frame and its children."""
        return list(self._joint(handle).motion_matrix())

    @sim("5")
    def getObjectChildPose(self, handle: Handle) -> list[float]:
        """Return the pose of a joint's children in the joint's own frame; for other objects, the identity."""
        found = self._objects[handle]
        return to_pose(found.motion_matrix() if isinstance(found, Joint) else IDENTITY)

    @sim("345")
    def setSphericalJointMatrix(self, handle: Handle, matrix: TwelveNumbers) -> None:
        """Set the rotation of a spherical joint; the position in the matrix is ignored."""
        joint, m = self._joint(handle), numbers(matrix, 12)
        if joint.motion != SPHERICAL:
            raise WrongValue(f"'{joint.name}' is a {joint.motion} joint: must be a spherical joint")
        turn = (*m[:3], 0.0, *m[4:7], 0.0, *m[8:11], 0.0)
        product = frames.multiply(turn, frames.invert(turn))
        if max(abs(a - b) for a, b in zip(product, IDENTITY)) > _TOLERANCE:
            raise WrongValue("expected the matrix of a rotation")
        joint.turn = frames.from_quaternion((0.0, 0.0, 0.0), frames.to_quaternion(turn))

    # ---- types, limits and modes

    @sim("345")
    def getJointType(self, handle: Handle) -> int:
        """Return sim.joint_revolute_subtype (10), _prismatic_subtype (11) or _spherical_subtype (12)."""
        return _TYPES[self._joint(handle).motion]

    @sim("345")
    def getJointInterval(self, handle: Handle) -> tuple[bool, list[float]]:
        """Return whether a joint has no limits, its lowest position and its range."""
        limits = self._joint(handle).limits
        return (True, list(_CYCLIC)) if limits is None else (False, [limits[0], limits[1] - limits[0]])

    @sim("345")
    def setJointInterval(self, handle: Handle, cyclic: bool, interval: Numbers = ()) -> None:
        """Set a joint's lowest position and its range; a cyclic joint has no limits."""
        joint = self._linear_joint(handle)
        if cyclic and joint.motion == PRISMATIC:
            raise WrongValue(f"'{joint.name}' is prismatic: only revolute joints are cyclic")
        low, extent = numbers(interval, 2) if not cyclic else _CYCLIC
        if extent <= 0:
            raise WrongValue(f"the range of a joint must be greater than 0, not {extent:g}")
        joint.limit(None if cyclic else (low, low + extent))

    @sim("345")
    def getJointMode(self, handle: Handle) -> tuple[int, int]:
        """Return 0 for a joint that only scripts move, 5 for a joint that the dynamics moves; and 0 as options."""
        return (_KINEMATIC_MODE if self._joint(handle).control.mode == KINEMATIC else _DYNAMIC_MODE), 0

    @sim("345")
    def setJointMode(self, handle: Handle, mode: int, _options: Any = 0) -> None:
        """Let only scripts move a joint (0), or let the dynamics move it (5), in its last dynamic mode."""
        joint = self._joint(handle)
        if mode not in (_KINEMATIC_MODE, _DYNAMIC_MODE):
            raise WrongValue("expected sim.jointmode_kinematic (0) or sim.jointmode_dynamic (5)")
        if (joint.control.mode == KINEMATIC) != (mode == _KINEMATIC_MODE):
            joint.change(mode=KINEMATIC if mode == _KINEMATIC_MODE else joint.dynamic_mode)

    # ---- targets and forces

    @sim("345")
    def getJointTargetPosition(self, handle: Handle) -> float:
        """Return a joint's target position."""
        return self._joint(handle).control.position

    @sim("345")
    def setJointTargetPosition(self, handle: Handle, position: Number, _motion: Any = None) -> None:
        """Set a joint's target position; a joint that only scripts move goes there at once."""
        (value,) = numbers((position,), 1)
        if not self._is_ignored(handle, "setJointTargetPosition"):
            self._linear_joint(handle).change(position=value)

    @sim("345")
    def getJointTargetVelocity(self, handle: Handle) -> float:
        """Return a joint's target velocity."""
        return self._joint(handle).control.velocity

    @sim("345")
    def setJointTargetVelocity(self, handle: Handle, velocity: Number, _motion: Any = None) -> None:
        """Set a joint's target velocity, for the velocity mode."""
        (value,) = numbers((velocity,), 1)
        if not self._is_ignored(handle, "setJointTargetVelocity"):
            self._linear_joint(handle).change(velocity=value)

    @sim("345", jointGetForce="3")
    def getJointForce(self, handle: Handle) -> float:
        """Return the force of a joint's motor in the last sub-step."""
        drive = self._joint(handle).drive
        return 0.0 if drive is None else drive.state()[2]

    @sim("5")
    def getJointTargetForce(self, handle: Handle) -> float:
        """Return the target force of a joint in force mode, otherwise its largest force."""
        control = self._joint(handle).control
        return control.force if control.mode == FORCE else control.max_force

    @sim("5")
    def setJointTargetForce(self, handle: Handle, force: Number, signedValue: bool = True) -> None:
        """Set a joint's force in force mode, signed or in the last direction; otherwise its largest force."""
        (value,) = numbers((force,), 1)
        if self._is_ignored(handle, "setJointTargetForce"):
            return
        joint = self._linear_joint(handle)
        if joint.control.mode != FORCE:
            joint.change(max_force=abs(value))
        elif signedValue:
            joint.change(force=value)
        else:
            joint.change(force=math.copysign(value, joint.control.velocity or joint.control.force or 1.0))

    @sim("45")
    def getJointMaxForce(self, handle: Handle) -> float:
        """Return the largest force of a joint's motor (3.x)."""
        return abs(self.getJointTargetForce(handle))

    @sim("345", setJointMaxForce="45")
    def setJointForce(self, handle: Handle, force: Number) -> None:
        """Set the largest force of a joint's motor (3.x)."""
        self.setJointTargetForce(handle, force, False)

    def _is_ignored(self, handle: int, function: str) -> bool:
        """Return whether an object is the joint of a propeller; if so, log that the call is ignored."""
        found = self._objects[handle]
        if found.kind != "joint" or isinstance(found, Joint):
            return False
        self._ignored.log(function, "the thrust model turns a propeller's blades; accepted and ignored")
        return True

    def _joint(self, handle: int) -> Joint:
        return self._found(handle, Joint, "a joint of the scene")

    def _linear_joint(self, handle: int) -> Joint:
        """Return a revolute or prismatic joint."""
        joint = self._joint(handle)
        if joint.motion == SPHERICAL:
            raise WrongValue(f"'{joint.name}' is spherical: setSphericalJointMatrix turns it")
        return joint
