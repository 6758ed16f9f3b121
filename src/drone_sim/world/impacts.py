"""Fast bodies that are about to hit something: Bullet detects a contact only when they are in it, or past it."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector
from drone_sim.mechanics.state import State

# Position of a body's centre of mass (m), orientation of its principal axes, velocities (m/s, rad/s), and its state.
Motion = tuple[Vector, Quaternion, Vector, Vector, State]
_MAX_MOTION = 0.001  # m, of a body in a part of a sub-step
_GAIN = 2.0  # m/s by which a body may become faster in a step and still be noticed
_MAX_PARTS = 1000
# The share of a penetration that Bullet corrects in each of its steps. The velocity of the correction would make fast
# bodies rebound in spite of a restitution of 0; PyBullet's default, the first, is for bodies moved into others.
_ERP, _ERP_OF_FAST = 0.08, 0.005


class Impacts:
    """Divides the sub-steps in which a fast body may hit another, unless any body has joints.

    The motors of joints have been given an impulse for an entire sub-step.
    """

    def __init__(self, client: int, sub_step: float):
        """Use a PyBullet client with this sub-step (s)."""
        self._client, self._sub_step = client, sub_step
        self._slow = _MAX_MOTION / sub_step  # m/s, below which a sub-step is not divided
        self._bodies: set[int] = set()
        self._jointed: set[int] = set()
        self._fast: list[int] = []

    def add(self, body: int) -> None:
        """Add a body; static bodies are not watched."""
        if pybullet.getDynamicsInfo(body, -1, self._client)[0]:
            self._bodies.add(body)
        if pybullet.getNumJoints(body, self._client):
            self._jointed.add(body)

    def forget(self, body: int) -> None:
        self._bodies.discard(body)
        self._jointed.discard(body)

    def begin_step(self, sub_steps: int, known: Mapping[int, Motion]) -> bool:
        """Return whether any fast body may hit something within the next `sub_steps` sub-steps.

        `known` are the motions that need not be read from PyBullet.
        """
        if self._jointed:
            return False
        duration, self._fast = sub_steps * self._sub_step, []
        for body in self._bodies:
            velocity = known[body][2] if body in known else pybullet.getBaseVelocity(body, self._client)[0]
            if math.hypot(*velocity) > self._slow and self._may_meet(body, velocity, duration, _GAIN * duration):
                self._fast.append(body)
        return bool(self._fast)

    def parts(self) -> int:
        """Return the number of parts for the next sub-step."""
        longest, step = 0.0, self._sub_step
        for body in self._fast:
            velocity = pybullet.getBaseVelocity(body, self._client)[0]
            if self._may_meet(body, velocity, 2 * step):
                longest = max(longest, math.hypot(*velocity) * step)
        return min(math.ceil(longest / _MAX_MOTION), _MAX_PARTS) or 1

    @contextlib.contextmanager
    def divided(self, part: float) -> Iterator[None]:
        """Set the duration of Bullet's steps to `part` (s), without rebound of fast bodies."""
        client = self._client
        pybullet.setPhysicsEngineParameter(part, contactERP=_ERP_OF_FAST, physicsClientId=client)
        try:
            yield
        finally:
            pybullet.setPhysicsEngineParameter(self._sub_step, contactERP=_ERP, physicsClientId=client)

    def _may_meet(self, body: int, velocity: Vector, duration: float, margin: float = 0.0) -> bool:
        """Return whether another body is near the way of a body with that velocity (m/s) for `duration` (s)."""
        x, y, z = velocity[0] * duration, velocity[1] * duration, velocity[2] * duration
        (low_x, low_y, low_z), (high_x, high_y, high_z) = pybullet.getAABB(body, -1, self._client)
        from_low = low_x + min(x, 0.0) - margin, low_y + min(y, 0.0) - margin, low_z + min(z, 0.0) - margin
        to_high = high_x + max(x, 0.0) + margin, high_y + max(y, 0.0) + margin, high_z + max(z, 0.0) + margin
        near = pybullet.getOverlappingObjects(from_low, to_high, self._client) or ()
        return any(other != body for other, _ in near)
