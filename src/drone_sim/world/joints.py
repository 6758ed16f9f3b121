"""Joints and links of assemblies: their states, limits and motors. rad, m, N m, N."""

from __future__ import annotations

import math
from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Vector, cross, turned
from drone_sim.mechanics.joint import FORCE, KINEMATIC, PASSIVE, POSITION, JointControl
from drone_sim.mechanics.state import Pose, State, compose, inverse

NO_LIMIT = 1e9  # rad or m
_UNREACHED_VELOCITY = 1e9  # rad/s or m/s: with this target a motor always gives its maximum force
_HOLDING_FORCE = 1e6  # N m or N; it keeps a joint where a script has placed it


class Joints:
    """The joints of one PyBullet client, by body and link."""

    def __init__(self, client: int, changed: Callable[[], None]):
        """Use a PyBullet client; `changed` is called when a joint has been placed elsewhere."""
        self._client = client
        self._notify = changed
        self._inertial: dict[tuple[int, int], Pose] = {}  # inertial frame from link frame
        self._limits: dict[tuple[int, int], tuple[float, float]] = {}  # set by scripts

    def link_state(self, body: int, link: int) -> State:
        """Return pose and velocity of a link's frame."""
        row = pybullet.getLinkState(body, link, 1, 1, self._client)
        centre, linear, angular = Pose(row[0], row[1]), row[6], row[7]
        if (body, link) not in self._inertial:
            self._inertial[body, link] = inverse(Pose(row[2], row[3]))
        link_frame = self._inertial[body, link]  # the pose that PyBullet gives for it is in single precision
        position, orientation = compose(centre, link_frame)
        x, y, z = cross(angular, turned(centre.orientation, link_frame.position))
        return State(position, orientation, (linear[0] + x, linear[1] + y, linear[2] + z), angular)

    def forget(self, body: int) -> None:
        for by_link in (self._inertial, self._limits):
            for key in [key for key in by_link if key[0] == body]:
                del by_link[key]  # type: ignore[attr-defined]

    def state(self, body: int, link: int) -> tuple[float, float, float]:
        """Return position and velocity of a link's joint, and its motor's force in the last sub-step."""
        value, velocity, _, force = pybullet.getJointState(body, link, self._client)
        return value, velocity, force

    def measure(self, body: int, link: int) -> None:
        """Let `load` measure a joint from now on."""
        pybullet.enableJointForceTorqueSensor(body, link, True, self._client)

    def load(self, body: int, link: int) -> tuple[Vector, Vector]:
        """Return force and torque of a link on its joint in the last sub-step, in the link's frame."""
        reaction = pybullet.getJointState(body, link, self._client)[2]  # of the joint on the link, inertial frame
        centre, orientation = pybullet.getLinkState(body, link, 0, 0, self._client)[2:4]
        fx, fy, fz = turned(orientation, reaction[:3])
        tx, ty, tz = turned(orientation, reaction[3:])
        ax, ay, az = cross(centre, (fx, fy, fz))
        return (-fx, -fy, -fz), (-tx - ax, -ty - ay, -tz - az)

    def put(self, body: int, link: int, value: float, velocity: float = 0.0) -> None:
        """Place a joint at a position, at rest or with a velocity."""
        pybullet.resetJointState(body, link, value, velocity, self._client)
        self._notify()

    def motor(self, body: int, link: int, mode: int, **numbers: float) -> None:
        """Set the motor of a joint, by PyBullet's mode and arguments, for all further sub-steps."""
        pybullet.setJointMotorControl2(body, link, mode, physicsClientId=self._client, **numbers)

    def limit(self, body: int, link: int, limits: tuple[float, float] | None) -> None:
        """Change the limits of a joint, or remove them."""
        low, high = limits or (-NO_LIMIT, NO_LIMIT)
        current = self._limits.get((body, link)) or pybullet.getJointInfo(body, link, self._client)[8:10]
        if current == (low, high) or (limits is None and current[0] > current[1]):  # in PyBullet: no limits
            return
        self._limits[body, link] = low, high
        pybullet.changeDynamics(body, link, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=self._client)


class JointDrive:
    """Drives a joint of an assembly, as mechanics.joint.Drive requires; rad, m, N m, N."""

    def __init__(self, joints: Joints, body: int, link: int):
        """Drive the joint above `link` of a body."""
        self._joints = joints
        self._at = body, link
        self._is_held = False

    def state(self) -> tuple[float, float, float]:
        """Return the joint's position, velocity, and its motor's force in the last sub-step."""
        return self._joints.state(*self._at)

    def put(self, value: float) -> None:
        """Place the joint at a position, at rest."""
        self._joints.put(*self._at, value)
        if self._is_held:
            self._hold(value)

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Change the joint's limits, or remove them."""
        self._joints.limit(*self._at, limits)

    def command(self, control: JointControl) -> None:
        """Control the motor by `control` from now on."""
        self._is_held = control.mode == KINEMATIC
        if self._is_held:
            self._hold(self.state()[0])
        elif control.mode == POSITION:
            self._joints.motor(
                *self._at, pybullet.POSITION_CONTROL, targetPosition=control.position, force=control.max_force
            )
        else:
            velocity, max_force = control.velocity, control.max_force
            if control.mode == PASSIVE:
                velocity, max_force = 0.0, 0.0
            elif control.mode == FORCE:  # by a target velocity that is never reached
                velocity, max_force = math.copysign(_UNREACHED_VELOCITY, control.force), abs(control.force)
            self._joints.motor(*self._at, pybullet.VELOCITY_CONTROL, targetVelocity=velocity, force=max_force)

    def _hold(self, value: float) -> None:
        mode = pybullet.POSITION_CONTROL
        self._joints.motor(*self._at, mode, targetPosition=value, positionGain=1.0, force=_HOLDING_FORCE)
