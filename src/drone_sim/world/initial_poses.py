"""Where everything stood at the beginning: a snapshot of PyBullet's would copy every mesh."""

from __future__ import annotations

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector


class InitialPoses:
    """The places of bodies, at rest, to which they can be put back."""

    def __init__(self, client: int):
        """Begin with none."""
        self._client = client
        self._places: dict[int, tuple[Vector, Quaternion, list[float]]] = {}

    def keep(self, body: int) -> None:
        """Remember where a body stands."""
        joints = range(pybullet.getNumJoints(body, self._client))
        angles = [pybullet.getJointState(body, joint, self._client)[0] for joint in joints]
        self._places[body] = (*pybullet.getBasePositionAndOrientation(body, self._client), angles)

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        self._places.pop(body, None)

    def bring_back(self) -> None:
        """Put all where they stood, at rest."""
        for body, (centre, turn, angles) in self._places.items():
            pybullet.resetBasePositionAndOrientation(body, centre, turn, self._client)
            pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)
            for joint, angle in enumerate(angles):
                pybullet.resetJointState(body, joint, angle, 0, self._client)
