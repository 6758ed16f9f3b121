"""Which bodies meet which, and which have lost their mass for a while."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Vector


class CollisionFilter:
    """What collides in one client's world; by body and link, -1 is the root."""

    def __init__(self, client: int, moved: Callable[[int], None]):
        """Take the client, and what is told of a body that stands still, or moves, from now on."""
        self._client = client
        self._moved = moved
        self._permeable: set[tuple[int, int]] = set()  # what nothing meets
        self._frozen: dict[int, tuple[float, Vector]] = {}  # mass and moments of what has lost them

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        self._permeable = {one for one in self._permeable if one[0] != body}
        self._frozen.pop(body, None)

    def let_everything_pass(self, body: int, link: int) -> None:
        """Make a link permeable: it collides with nothing, and no ray meets it."""
        pybullet.setCollisionFilterGroupMask(body, link, 0, 0, self._client)
        self._permeable.add((body, link))

    def is_permeable(self, body: int, link: int) -> bool:
        """Tell whether nothing meets a link."""
        return (body, link) in self._permeable

    def let_pass(self, body: int, other: int, passes: bool = True) -> None:
        """Let two bodies go through each other, or, after that, collide again."""
        links = [range(-1, pybullet.getNumJoints(one, self._client)) for one in (body, other)]
        for link, another in itertools.product(*links):
            pybullet.setCollisionFilterPair(body, other, link, another, int(not passes), self._client)

    def freeze(self, body: int, still: bool) -> None:
        """Take a body's mass away and stop it, or give the mass back."""
        if still and body in self._frozen:
            return
        if still:
            mass, _, moments = pybullet.getDynamicsInfo(body, -1, self._client)[:3]
            self._frozen[body] = mass, moments
            pybullet.changeDynamics(body, -1, mass=0, physicsClientId=self._client)
            pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)
        elif body in self._frozen:
            mass, moments = self._frozen.pop(body)
            pybullet.changeDynamics(body, -1, mass=mass, physicsClientId=self._client)
            pybullet.changeDynamics(body, -1, localInertiaDiagonal=moments, physicsClientId=self._client)
        self._moved(body)
