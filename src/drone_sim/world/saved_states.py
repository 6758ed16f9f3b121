"""Saved states of bodies: their initial poses, and snapshots of the entire dynamic state."""

from __future__ import annotations

from collections.abc import Callable

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector


class SavedStates:
    """The initial poses of one client's bodies, at rest, and its snapshots.

    A snapshot of PyBullet's copies every mesh, so the initial state is not saved as one.
    """

    def __init__(self, client: int, all_moved: Callable[[], None]):
        """Start without saved states; `all_moved` is called when all bodies have been placed."""
        self._client, self._all_moved = client, all_moved
        self._places: dict[int, tuple[Vector, Quaternion, list[float]]] = {}
        self._snapshots: set[int] = set()

    # ---- initial poses

    def keep(self, body: int) -> None:
        """Save the pose of a body, at rest, for `begin_anew`."""
        joints = range(pybullet.getNumJoints(body, self._client))
        angles = [pybullet.getJointState(body, joint, self._client)[0] for joint in joints]
        self._places[body] = (*pybullet.getBasePositionAndOrientation(body, self._client), angles)

    def forget(self, body: int) -> None:
        self._places.pop(body, None)

    def begin_anew(self) -> None:
        """Place all saved bodies at their saved poses, at rest."""
        self._all_moved()
        for body, (centre, orientation, angles) in self._places.items():
            pybullet.resetBasePositionAndOrientation(body, centre, orientation, self._client)
            pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)
            for joint, angle in enumerate(angles):
                pybullet.resetJointState(body, joint, angle, 0, self._client)

    # ---- snapshots

    def snapshot(self) -> int:
        """Save the exact dynamic state, with contacts; return a number for `restore` and `forget_snapshot`."""
        number = pybullet.saveState(self._client)
        self._snapshots.add(number)
        return int(number)

    def restore(self, number: int) -> None:
        """Restore a snapshot, to the last bit."""
        self._all_moved()
        pybullet.restoreState(number, physicsClientId=self._client)

    def has_snapshot(self, number: int) -> bool:
        """Return whether a snapshot exists, that is, no body was added or removed since."""
        return number in self._snapshots

    def forget_snapshot(self, number: int) -> None:
        if number in self._snapshots:
            self._snapshots.remove(number)
            pybullet.removeState(number, physicsClientId=self._client)

    def forget_snapshots(self) -> None:
        """Free all snapshots, which PyBullet would keep; after a change of bodies they are invalid."""
        for number in self._snapshots:
            pybullet.removeState(number, physicsClientId=self._client)
        self._snapshots.clear()
