"""Fast bodies that are about to meet something: Bullet would have them inside of it, or past it, before it looks."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

import pybullet

_REACH = 0.001  # m that a body goes in a part of a sub-step
_SLOW = _REACH / 0.005  # m/s, of what needs no parts
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

    def begin_step(self) -> bool:
        """Look which bodies are fast, or may be within a step; return whether any is."""
        self._fast = [] if self._jointed else [body for body in self._bodies if self._speed(body) > _SLOW]
        return bool(self._fast)

    def parts(self) -> int:
        """Return in how many parts the sub-step that comes is to be done."""
        ways = (self._speed(body) * self._sub_step for body in self._fast if self._may_meet_something(body))
        return min(math.ceil(max(ways, default=0.0) / _REACH), _MOST_PARTS) or 1

    @contextlib.contextmanager
    def divided(self, part: float) -> Iterator[None]:
        """Let Bullet's steps last that long (s), and what is fast not rebound."""
        client = self._client
        pybullet.setPhysicsEngineParameter(part, contactERP=_RECOVERY_OF_FAST, physicsClientId=client)
        yield
        pybullet.setPhysicsEngineParameter(self._sub_step, contactERP=_RECOVERY, physicsClientId=client)

    def _speed(self, body: int) -> float:
        return math.hypot(*pybullet.getBaseVelocity(body, self._client)[0])

    def _may_meet_something(self, body: int) -> bool:
        way = [2 * self._sub_step * one for one in pybullet.getBaseVelocity(body, self._client)[0]]
        low, high = pybullet.getAABB(body, -1, self._client)
        from_low = [one + min(step, 0.0) for one, step in zip(low, way)]
        to_high = [one + max(step, 0.0) for one, step in zip(high, way)]
        near = pybullet.getOverlappingObjects(from_low, to_high, self._client) or ()
        return any(other != body for other, _ in near)
