"""Fast bodies that are about to meet something: Bullet would have them inside of it, or past it, before it looks."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping

import pybullet

from drone_sim.mechanics.frames import Vector

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

    def begin_step(self, sub_steps: int, known: Mapping[int, Vector]) -> bool:
        """Look which bodies are fast, and may meet something within so many sub-steps; return whether any may.

        `known` are velocities (m/s) that need not be asked for.
        """
        duration = sub_steps * self._sub_step
        self._fast = [
            body
            for body in (() if self._jointed else self._bodies)
            if self._speed(body, known.get(body)) > self._slow
            and self._may_meet_something(body, duration, _GAIN * duration)
        ]
        return bool(self._fast)

    def parts(self) -> int:
        """Return in how many parts the sub-step that comes is to be done."""
        step = self._sub_step
        ways = (self._speed(body) * step for body in self._fast if self._may_meet_something(body, 2 * step))
        return min(math.ceil(max(ways, default=0.0) / _REACH), _MOST_PARTS) or 1

    @contextlib.contextmanager
    def divided(self, part: float) -> Iterator[None]:
        """Let Bullet's steps last that long (s), and what is fast not rebound."""
        client = self._client
        pybullet.setPhysicsEngineParameter(part, contactERP=_RECOVERY_OF_FAST, physicsClientId=client)
        try:
            yield
        finally:
            pybullet.setPhysicsEngineParameter(self._sub_step, contactERP=_RECOVERY, physicsClientId=client)

    def _speed(self, body: int, velocity: Vector | None = None) -> float:
        return math.hypot(*(velocity or pybullet.getBaseVelocity(body, self._client)[0]))

    def _may_meet_something(self, body: int, duration: float, margin: float = 0.0) -> bool:
        way = [one * duration for one in pybullet.getBaseVelocity(body, self._client)[0]]
        low, high = pybullet.getAABB(body, -1, self._client)
        from_low = [one + min(step, 0.0) - margin for one, step in zip(low, way)]
        to_high = [one + max(step, 0.0) + margin for one, step in zip(high, way)]
        near = pybullet.getOverlappingObjects(from_low, to_high, self._client) or ()
        return any(other != body for other, _ in near)
