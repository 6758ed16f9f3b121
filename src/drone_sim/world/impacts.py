"""Fast bodies that are about to meet something: Bullet would have them inside of it, or past it, before it looks."""

from __future__ import annotations

import math

import pybullet

# m in a (part of a) sub-step; Bullet makes a contact before two bodies touch, 20 mm apart, and lets them just meet
_REACH = 0.015
_GAIN = 2.0  # m/s that a body may win within a step without a look
_MOST_PARTS = 1000


class Impacts:
    """Divides the sub-steps in which a fast body may meet another."""

    def __init__(self, client: int, sub_step: float):
        """Take PyBullet's client, and the sub-step (s)."""
        self._client, self._sub_step = client, sub_step
        self._bodies: set[int] = set()
        self._fast: list[int] = []

    def add(self, body: int) -> None:
        """Know a body, if the dynamics moves it."""
        if pybullet.getDynamicsInfo(body, -1, self._client)[0]:
            self._bodies.add(body)

    def forget(self, body: int) -> None:
        """Know nothing of a body any more."""
        self._bodies.discard(body)

    def begin_step(self) -> bool:
        """Look which bodies are fast, or may be within a step; return whether any is."""
        limit = max(_REACH / self._sub_step - _GAIN, 0.0)
        self._fast = [body for body in self._bodies if self._speed(body) > limit]
        return bool(self._fast)

    def parts(self) -> int:
        """Return in how many parts the sub-step that comes is to be done."""
        ways = (self._speed(body) * self._sub_step for body in self._fast if self._may_meet_something(body))
        return min(math.ceil(max(ways, default=0.0) / _REACH), _MOST_PARTS) or 1

    def _speed(self, body: int) -> float:
        return math.hypot(*pybullet.getBaseVelocity(body, self._client)[0])

    def _may_meet_something(self, body: int) -> bool:
        way = [2 * self._sub_step * one for one in pybullet.getBaseVelocity(body, self._client)[0]]
        for link in range(-1, pybullet.getNumJoints(body, self._client)):
            low, high = pybullet.getAABB(body, link, self._client)
            from_low = [one + min(step, 0.0) for one, step in zip(low, way)]
            to_high = [one + max(step, 0.0) for one, step in zip(high, way)]
            near = pybullet.getOverlappingObjects(from_low, to_high, self._client) or ()
            if any(other != body for other, _ in near):
                return True
        return False
