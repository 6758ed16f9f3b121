"""The joints of assemblies, and their links: where they are, and what their motors do. rad, m, N m, N."""

from __future__ import annotations

from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Vector, cross, turned
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

    def put(self, body: int, link: int, value: float) -> None:
        """Put a joint somewhere, at rest."""
        pybullet.resetJointState(body, link, value, 0, self._client)
        self._changed()

    def let_go(self, body: int, link: int) -> None:
        """Let a joint turn freely."""
        self._motor(body, link, pybullet.VELOCITY_CONTROL, force=0)

    def go_to(self, body: int, link: int, target: float, max_force: float) -> None:
        """Let a motor bring a joint to a position."""
        self._motor(body, link, pybullet.POSITION_CONTROL, targetPosition=target, force=max_force)

    def hold(self, body: int, link: int, value: float) -> None:
        """Hold a joint where it has been put."""
        self._motor(body, link, pybullet.POSITION_CONTROL, targetPosition=value, positionGain=1.0, force=_STIFF)

    def run_at(self, body: int, link: int, velocity: float, max_force: float) -> None:
        """Let a motor keep a joint at a velocity."""
        self._motor(body, link, pybullet.VELOCITY_CONTROL, targetVelocity=velocity, force=max_force)

    def push(self, body: int, link: int, force: float) -> None:
        """Let a motor give a force, from now on in every sub-step: towards a velocity that is never reached."""
        towards = _AT_ONCE if force >= 0 else -_AT_ONCE
        self._motor(body, link, pybullet.VELOCITY_CONTROL, targetVelocity=towards, force=abs(force))

    def limit(self, body: int, link: int, limits: tuple[float, float] | None) -> None:
        """Let a joint have other limits, or none."""
        low, high = limits or (-NO_LIMIT, NO_LIMIT)
        known = self._limits.get((body, link)) or pybullet.getJointInfo(body, link, self._client)[8:10]
        if known == (low, high) or (limits is None and known[0] > known[1]):  # PyBullet's word for none
            return
        self._limits[body, link] = low, high
        pybullet.changeDynamics(body, link, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=self._client)

    def _motor(self, body: int, link: int, mode: int, **numbers: float) -> None:
        pybullet.setJointMotorControl2(body, link, mode, physicsClientId=self._client, **numbers)
