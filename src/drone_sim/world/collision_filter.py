"""Which bodies collide with each other, and which have lost their mass for a while."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Vector


class CollisionFilter:
    """The collisions of one client; by body and link (-1: the root)."""

    def __init__(self, client: int, moved: Callable[[int], None]):
        """Use a PyBullet client; `moved` is called for a body that becomes static or dynamic."""
        self._client = client
        self._moved = moved
        self._permeable: set[tuple[int, int]] = set()  # links that collide with nothing
        self._frozen: dict[int, tuple[float, Vector]] = {}  # mass and moments of inertia of frozen bodies

    def forget(self, body: int) -> None:
        self._permeable = {key for key in self._permeable if key[0] != body}
        self._frozen.pop(body, None)

    def let_everything_pass(self, body: int, link: int) -> None:
        """Make a link permeable: it collides with nothing, and no ray hits it."""
        pybullet.setCollisionFilterGroupMask(body, link, 0, 0, self._client)
        self._permeable.add((body, link))

    def is_permeable(self, body: int, link: int) -> bool:
        """Return whether a link collides with nothing."""
        return (body, link) in self._permeable

    def let_pass(self, body: int, other: int, passes: bool = True) -> None:
        """Disable collisions between two bodies, or enable them again."""
        links = [range(-1, pybullet.getNumJoints(either, self._client)) for either in (body, other)]
        for link, another in itertools.product(*links):
            pybullet.setCollisionFilterPair(body, other, link, another, int(not passes), self._client)

    def freeze(self, body: int, still: bool) -> None:
        """Take away a body's mass and stop it (`still`), or restore its mass."""
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
