"""Fast bodies that are about to meet something: Bullet would have them inside of it, or past it, before it looks."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping

import pybullet

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.state import Motion

_REACH = 0.001  # m that a body goes in a part of a sub-step
_GAIN = 2.0  # m/s that a body may win in a step without being looked after
_MOST_PARTS = 1000
# Of how deep two bodies are in each other Bullet takes back this share in each of its steps: a velocity, with which
# what was fast would rebound though restitution is 0. PyBullet's own moves what is carried into something.
_RECOVERY, _RECOVERY_OF_FAST = 0.08, 0.005


class Impacts:
    """Divides the sub-steps in which a fast body may meet another; but none where any body has joints.

    Their motors have been told an impulse for a whole sub-step.
    """

    def __init__(self, client: int, sub_step: float):
        """Take PyBullet's client, and the sub-step (s)."""
        self._client, self._sub_step = client, sub_step
        self._slow = _REACH / sub_step  # m/s, of what needs no parts
        self._bodies: set[int] = set()
        self._jointed: set[int] = set()
        self._fast: list[int] = []

    def add(self, body: int) -> None:
        """Know a body, if the dynamics moves it."""
        if pybullet.getDynamicsInfo(body, -1, self._client)[0]:
            self._bodies.add(body)
        if pybullet.getNumJoints(body, self._client):
            self._jointed.add(body)

    def forget(self, body: int) -> None:
        """Know nothing of a body any more."""
        self._bodies.discard(body)
        self._jointed.discard(body)

    def begin_step(self, sub_steps: int, known: Mapping[int, Motion]) -> bool:
        """Look which bodies are fast, and may meet something within so many sub-steps; return whether any may.

        `known` is what need not be asked for.
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
        """Return in how many parts the sub-step that comes is to be done."""
        longest, step = 0.0, self._sub_step
        for body in self._fast:
            velocity = pybullet.getBaseVelocity(body, self._client)[0]
            if self._may_meet(body, velocity, 2 * step):
                longest = max(longest, math.hypot(*velocity) * step)
        return min(math.ceil(longest / _REACH), _MOST_PARTS) or 1

    @contextlib.contextmanager
    def divided(self, part: float) -> Iterator[None]:
        """Let Bullet's steps last that long (s), and what is fast not rebound."""
        client = self._client
        pybullet.setPhysicsEngineParameter(part, contactERP=_RECOVERY_OF_FAST, physicsClientId=client)
        try:
            yield
        finally:
            pybullet.setPhysicsEngineParameter(self._sub_step, contactERP=_RECOVERY, physicsClientId=client)

    def _may_meet(self, body: int, velocity: Vector, duration: float, margin: float = 0.0) -> bool:
        """Tell whether anything else is near the way of a body (its velocity, m/s) through so long (s)."""
        x, y, z = velocity[0] * duration, velocity[1] * duration, velocity[2] * duration
        (low_x, low_y, low_z), (high_x, high_y, high_z) = pybullet.getAABB(body, -1, self._client)
        from_low = low_x + min(x, 0.0) - margin, low_y + min(y, 0.0) - margin, low_z + min(z, 0.0) - margin
        to_high = high_x + max(x, 0.0) + margin, high_y + max(y, 0.0) + margin, high_z + max(z, 0.0) + margin
        near = pybullet.getOverlappingObjects(from_low, to_high, self._client) or ()
        return any(other != body for other, _ in near)
