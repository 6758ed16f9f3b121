"""The joints of assemblies, and their links: where they are, and what their motors do. rad, m, N m, N."""

from __future__ import annotations

import math
from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Vector, cross, turned
from drone_sim.mechanics.joint import FORCE, KINEMATIC, PASSIVE, POSITION, JointControl
from drone_sim.mechanics.state import Pose, State, compose, inverse

NO_LIMIT = 1e9  # rad or m
_AT_ONCE = 1e9  # rad/s or m/s: a motor that is to get there gives all that it has, which is a force
_STIFF = 1e6  # N m or N, of what holds a joint where a script has put it


class Joints:
    """The joints in one client's world, by body and link."""

    def __init__(self, client: int, changed: Callable[[], None]):
        """Take the client, and what is called when something has been put somewhere."""
        self._client = client
        self._changed = changed
        self._inertial: dict[tuple[int, int], Pose] = {}  # inertial frame from the link's
        self._limits: dict[tuple[int, int], tuple[float, float]] = {}  # that a script has set

    def link_state(self, body: int, link: int) -> State:
        """Return pose and velocity of a link's frame."""
        found = pybullet.getLinkState(body, link, 1, 1, self._client)
        centre, linear, angular = Pose(found[0], found[1]), found[6], found[7]
        if (body, link) not in self._inertial:
            self._inertial[body, link] = inverse(Pose(found[2], found[3]))
        back = self._inertial[body, link]  # the link's own pose is told in single precision
        position, orientation = compose(centre, back)
        x, y, z = cross(angular, turned(centre.orientation, back.position))
        return State(position, orientation, (linear[0] + x, linear[1] + y, linear[2] + z), angular)

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        for known in (self._inertial, self._limits):
            for key in [key for key in known if key[0] == body]:
                del known[key]  # type: ignore[attr-defined]

    def state(self, body: int, link: int) -> tuple[float, float, float]:
        """Return position and velocity of the joint above a link, and what its motor gave in the last sub-step."""
        value, velocity, _, force = pybullet.getJointState(body, link, self._client)
        return value, velocity, force

    def measure(self, body: int, link: int) -> None:
        """Let a joint tell its `load` from now on."""
        pybullet.enableJointForceTorqueSensor(body, link, True, self._client)

    def load(self, body: int, link: int) -> tuple[Vector, Vector]:
        """Return force and torque by which a link acted on its joint in the last sub-step, in the link's frame."""
        reaction = pybullet.getJointState(body, link, self._client)[2]  # on the link, in its inertial frame
        centre, turn = pybullet.getLinkState(body, link, 0, 0, self._client)[2:4]
        fx, fy, fz = turned(turn, reaction[:3])
        tx, ty, tz = turned(turn, reaction[3:])
        ax, ay, az = cross(centre, (fx, fy, fz))
        return (-fx, -fy, -fz), (-tx - ax, -ty - ay, -tz - az)

    def put(self, body: int, link: int, value: float, velocity: float = 0.0) -> None:
        """Put a joint somewhere, at rest or moving."""
        pybullet.resetJointState(body, link, value, velocity, self._client)
        self._changed()

    def motor(self, body: int, link: int, mode: int, **numbers: float) -> None:
        """Let a joint's motor do what PyBullet calls so, from now on in every sub-step."""
        pybullet.setJointMotorControl2(body, link, mode, physicsClientId=self._client, **numbers)

    def limit(self, body: int, link: int, limits: tuple[float, float] | None) -> None:
        """Let a joint have other limits, or none."""
        low, high = limits or (-NO_LIMIT, NO_LIMIT)
        known = self._limits.get((body, link)) or pybullet.getJointInfo(body, link, self._client)[8:10]
        if known == (low, high) or (limits is None and known[0] > known[1]):  # PyBullet's word for none
            return
        self._limits[body, link] = low, high
        pybullet.changeDynamics(body, link, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=self._client)


class JointDrive:
    """Moves a joint in the world, as mechanics.joint.Drive says; rad, m, N m, N."""

    def __init__(self, joints: Joints, body: int, link: int):
        """Take the joints of the world, the body in it, and the link below the joint."""
        self._joints = joints
        self._at = body, link
        self._is_held = False

    def state(self) -> tuple[float, float, float]:
        """Return its position and velocity, and what its motor gave in the last sub-step."""
        return self._joints.state(*self._at)

    def put(self, value: float) -> None:
        """Put it at a position, at rest."""
        self._joints.put(*self._at, value)
        if self._is_held:
            self._hold(value)

    def limit(self, limits: tuple[float, float] | None) -> None:
        """Let it have other limits, or none."""
        self._joints.limit(*self._at, limits)

    def command(self, control: JointControl) -> None:
        """Let its motor do what is told from now on."""
        self._is_held = control.mode == KINEMATIC
        if self._is_held:
            self._hold(self.state()[0])
        elif control.mode == POSITION:
            self._joints.motor(
                *self._at, pybullet.POSITION_CONTROL, targetPosition=control.position, force=control.max_force
            )
        else:
            velocity, most = control.velocity, control.max_force
            if control.mode == PASSIVE:
                velocity, most = 0.0, 0.0
            elif control.mode == FORCE:  # towards a velocity that is never reached
                velocity, most = math.copysign(_AT_ONCE, control.force), abs(control.force)
            self._joints.motor(*self._at, pybullet.VELOCITY_CONTROL, targetVelocity=velocity, force=most)

    def _hold(self, value: float) -> None:
        """Hold it where it has been put."""
        mode = pybullet.POSITION_CONTROL
        self._joints.motor(*self._at, mode, targetPosition=value, positionGain=1.0, force=_STIFF)
