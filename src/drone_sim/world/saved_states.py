"""What bodies can be put back to: where they began, and snapshots of the whole dynamic state."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector


class SavedStates:
    """The initial places of one client's bodies, at rest, and its snapshots.

    A snapshot of PyBullet's would copy every mesh, so there is none for where they began.
    """

    def __init__(self, client: int, all_moved: Callable[[], None]):
        """Begin with none; `all_moved` is called when everything has been put somewhere."""
        self._client, self._all_moved = client, all_moved
        self._places: dict[int, tuple[Vector, Quaternion, list[float]]] = {}
        self._snapshots: set[int] = set()

    # ---- where they began

    def keep_all(self, bodies: Iterable[int]) -> None:
        """Remember where bodies stand, at rest, and let the first run begin like every other, to the last bit."""
        for body in bodies:
            self.keep(body)
        self.begin_anew()

    def keep(self, body: int) -> None:
        """Remember where a body stands, at rest, for `begin_anew`."""
        joints = range(pybullet.getNumJoints(body, self._client))
        angles = [pybullet.getJointState(body, joint, self._client)[0] for joint in joints]
        self._places[body] = (*pybullet.getBasePositionAndOrientation(body, self._client), angles)

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        self._places.pop(body, None)

    def begin_anew(self) -> None:
        """Put all that are kept where they stood, at rest."""
        self._all_moved()
        for body, (centre, turn, angles) in self._places.items():
            pybullet.resetBasePositionAndOrientation(body, centre, turn, self._client)
            pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)
            for joint, angle in enumerate(angles):
                pybullet.resetJointState(body, joint, angle, 0, self._client)

    # ---- snapshots

    def snapshot(self) -> int:
        """Remember the exact dynamic state, contacts included; return a number for `restore` and `forget_snapshot`."""
        number = pybullet.saveState(self._client)
        self._snapshots.add(number)
        return int(number)

    def restore(self, number: int) -> None:
        """Bring back what `snapshot` remembered, to the last bit."""
        self._all_moved()
        pybullet.restoreState(number, physicsClientId=self._client)

    def has_snapshot(self, number: int) -> bool:
        """Tell whether a snapshot is there: no body has come or gone since."""
        return number in self._snapshots

    def forget_snapshot(self, number: int) -> None:
        """Free a snapshot."""
        if number in self._snapshots:
            self._snapshots.remove(number)
            pybullet.removeState(number, physicsClientId=self._client)

    def forget_snapshots(self) -> None:
        """Free them all, which PyBullet would keep: other bodies are there than were."""
        for number in self._snapshots:
            pybullet.removeState(number, physicsClientId=self._client)
        self._snapshots.clear()
