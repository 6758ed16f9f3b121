"""Forces and torques that scripts apply to shapes; they keep their directions in the world through a step."""

from __future__ import annotations

import pybullet

from drone_sim.mechanics.frames import Vector

_NONE: Vector = (0.0, 0.0, 0.0)


class ShapeForces:
    """The sums of forces and torques on each link (-1: the root) of a body in the next step."""

    def __init__(self, client: int):
        self._client = client
        self.sums: dict[tuple[int, int], tuple[Vector, Vector]] = {}

    def add(self, body: int, link: int, force: Vector, torque: Vector) -> None:
        """Add a force (N) at the centre of mass and a torque (N m) for the next step, both in the world frame."""
        (fx, fy, fz), (tx, ty, tz) = self.sums.get((body, link), (_NONE, _NONE))
        force = fx + force[0], fy + force[1], fz + force[2]
        self.sums[body, link] = force, (tx + torque[0], ty + torque[1], tz + torque[2])

    def drop(self, body: int, link: int, forces: bool, torques: bool) -> None:
        """Remove the forces, or the torques, or both, that were added since the last step."""
        force, torque = self.sums.get((body, link), (_NONE, _NONE))
        self.sums[body, link] = _NONE if forces else force, _NONE if torques else torque

    def forget(self, body: int) -> None:
        self.sums = {key: total for key, total in self.sums.items() if key[0] != body}

    def apply(self) -> None:
        """Apply all sums in the next sub-step."""
        client, in_world = self._client, pybullet.WORLD_FRAME
        for (body, link), (force, torque) in self.sums.items():
            if link == -1:
                centre = pybullet.getBasePositionAndOrientation(body, client)[0]
            else:
                centre = pybullet.getLinkState(body, link, 0, 1, client)[0]
            pybullet.applyExternalForce(body, link, force, centre, in_world, client)
            pybullet.applyExternalTorque(body, link, torque, in_world, client)
