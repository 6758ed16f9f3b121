"""The term ω × Iω in Euler's equations of all links: omitted as in CoppeliaSim, or integrated accurately.

PyBullet applies it to every multibody and has no option for it. It subtracts I⁻¹ (ω × Iω) h from the angular velocity
in a sub-step of length h, an explicit step: a tumbling body gains energy. A torque ω × Iω cancels the term.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Set

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector, cross, turned

SLOW = 1e-8  # (rad/s)²; below this the term is smaller than the noise of moving bodies
_ROUND = 1e-9  # allowed difference of moments of inertia, as part of the largest: cubes and spheres have no such term
_apply_torque, _ALONG_AXES = pybullet.applyExternalTorque, pybullet.LINK_FRAME
_ITERATIONS = 6  # each reduces the error to h |ω| / 2 of it: in all to 1e-10 at 9 rad/s and 5 ms


class NoGyroscopicTerm:
    """Cancels the term that PyBullet applies. For the bodies that Dynamics pushes, Dynamics itself cancels it."""

    acts_after_steps = False  # whether `end_sub_step` has an effect

    def __init__(self, client: int):
        """Start with no bodies in PyBullet's `client`."""
        self._client = client
        self._roots: dict[int, Vector] = {}  # moments of inertia (kg m², along the principal axes), by body
        # Those of the roots whose term `torque_of_turn` cancels.
        self.moments_to_cancel: Mapping[int, Vector] = self._roots
        self._links: dict[int, dict[int, Vector]] = {}  # of all other links, by PyBullet's number
        self._unpushed: Set[int] = set()  # of _roots, those that Dynamics does not push in this step

    def add(self, body: int) -> None:
        links = {}
        for number in range(-1, pybullet.getNumJoints(body, self._client)):
            mass, _, moments, *_ = pybullet.getDynamicsInfo(body, number, self._client)
            if mass and max(moments) - min(moments) > _ROUND * max(moments):
                links[number] = moments
        if -1 in links:
            self._roots[body] = links.pop(-1)
        if links:
            self._links[body] = links

    def forget(self, body: int) -> None:
        self._roots.pop(body, None)
        self._links.pop(body, None)

    def begin_step(self, pushed: Iterable[int]) -> bool:
        """Take the bodies that Dynamics pushes in this step; return whether `begin_sub_step` has anything to do."""
        self._unpushed = self._roots.keys() - pushed
        return bool(self._unpushed or self._links)

    def begin_sub_step(self, duration: float) -> None:
        """Apply torques for the next PyBullet step of `duration` (s) to all bodies that Dynamics does not push."""
        for body in self._unpushed:
            velocity = pybullet.getBaseVelocity(body, self._client)[1]
            if _rotates(velocity):
                attitude = pybullet.getBasePositionAndOrientation(body, self._client)[1]
                torque = self._torque(self._roots[body], _in_frame(attitude, velocity), duration)
                _apply_torque(body, -1, torque, _ALONG_AXES, self._client)
        for body, links in self._links.items():
            states = pybullet.getLinkStates(body, list(links), 1, 1, self._client)  # with velocities, current attitudes
            for (number, moments), state in zip(links.items(), states):
                if _rotates(state[7]):
                    torque = self._torque(moments, _in_frame(state[1], state[7]), duration)
                    _apply_torque(body, number, torque, _ALONG_AXES, self._client)

    def end_sub_step(self, duration: float) -> None:
        """Do nothing: the whole torque acted before the step."""

    def torque_of_velocity(
        self, moments: Vector, attitude: Quaternion, velocity: Vector, duration: float
    ) -> Vector | None:
        """Return the torque on a root (N m, principal axes) with this angular velocity; None if it hardly rotates."""
        return self._torque(moments, _in_frame(attitude, velocity), duration) if _rotates(velocity) else None

    def _torque(self, moments: Vector, velocity: Vector, _duration: float) -> Vector:
        """Return ω × Iω (N m), all along the principal axes."""
        (a, b, c), (p, q, r) = moments, velocity
        return (c - b) * q * r, (a - c) * r * p, (b - a) * p * q


class GyroscopicTerm(NoGyroscopicTerm):
    """Applies half of the term before PyBullet rotates a body, half of it after: this conserves the angular momentum L.

    With the velocities u before and v between, I v = exp(-v h/2) I u, and after that I w = exp(-v h/2) I v, all along
    the principal axes, while Bullet rotates the body by v h. Being symmetric in time it neither gains nor loses energy.
    Links below a joint have PyBullet's own term, since their velocities cannot be set after a step.
    """

    acts_after_steps = True

    def __init__(self, client: int):
        """Start with no bodies in PyBullet's `client`."""
        super().__init__(client)
        self.moments_to_cancel = {}  # half of the term remains, and an attitude does not show the half after a step

    def add(self, body: int) -> None:
        """Add a body; the term acts on its root."""
        super().add(body)
        self._links.pop(body, None)

    def begin_step(self, pushed: Iterable[int]) -> bool:
        """As in the base class, but for all roots: Dynamics leaves those that it pushes to `begin_sub_step`, too."""
        return super().begin_step(())

    def end_sub_step(self, duration: float) -> None:
        """Change every root's velocity by the second half of the term."""
        client = self._client
        for body, moments in self._roots.items():
            linear, velocity = pybullet.getBaseVelocity(body, client)
            if _rotates(velocity):
                attitude = pybullet.getBasePositionAndOrientation(body, client)[1]
                between = _in_frame(attitude, velocity)
                after = _velocity(moments, _rotated_back(between, duration / 2, _momentum(moments, between)))
                pybullet.resetBaseVelocity(body, linear, turned(attitude, after), client)

    def _torque(self, moments: Vector, velocity: Vector, duration: float) -> Vector:
        momentum, between = _momentum(moments, velocity), velocity
        for _ in range(_ITERATIONS):
            half = _rotated_back(between, duration / 2, momentum)
            between = _velocity(moments, half)
        changes = zip(super()._torque(moments, velocity, duration), half, momentum)
        x, y, z = (torque + (new - old) / duration for torque, new, old in changes)
        return x, y, z


def _rotates(velocity: Vector) -> bool:
    x, y, z = velocity
    return x * x + y * y + z * z > SLOW


def _in_frame(orientation: Quaternion, vector: Vector) -> Vector:
    """Return a vector of the world in a frame with this orientation."""
    x, y, z, w = orientation
    return turned((-x, -y, -z, w), vector)


def torque_of_turn(moments: Vector, before: Quaternion, now: Quaternion, duration: float) -> Vector | None:
    """Return ω × Iω of a body from its rotation over a step, which is faster than reading its velocity.

    None if it hardly rotates. Bullet applies the rotation at once, about an axis that is the same before and after. It
    is all in one function, because this runs in every sub-step.
    """
    (x0, y0, z0, w0), (x1, y1, z1, w1) = before, now
    x = w0 * x1 - w1 * x0 - y0 * z1 + z0 * y1
    y = w0 * y1 - w1 * y0 - z0 * x1 + x0 * z1
    z = w0 * z1 - w1 * z0 - x0 * y1 + y0 * x1
    square = x * x + y * y + z * z
    if square < SLOW * duration * duration / 4 or square >= 1.0:
        return None
    sine = math.sqrt(square)
    scale = 2.0 * math.asin(sine) / (sine * duration)
    (a, b, c), p, q, r = moments, x * scale, y * scale, z * scale
    return (c - b) * q * r, (a - c) * r * p, (b - a) * p * q


def _momentum(moments: Vector, velocity: Vector) -> Vector:
    return moments[0] * velocity[0], moments[1] * velocity[1], moments[2] * velocity[2]


def _velocity(moments: Vector, momentum: Vector) -> Vector:
    return momentum[0] / moments[0], momentum[1] / moments[1], momentum[2] / moments[2]


def _rotated_back(velocity: Vector, duration: float, vector: Vector) -> Vector:
    """Return exp(-v t) of a vector (Rodrigues' formula)."""
    speed = math.hypot(*velocity)
    axis = _velocity((speed, speed, speed), velocity)
    sine, versine = math.sin(-speed * duration), 1 - math.cos(speed * duration)
    once = cross(axis, vector)
    twice = cross(axis, once)
    x, y, z = (old + sine * first + versine * second for old, first, second in zip(vector, once, twice))
    return x, y, z
