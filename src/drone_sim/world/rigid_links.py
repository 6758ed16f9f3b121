"""Rigid links between bodies: PyBullet's fixed constraints, each of which keeps two frames at one pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import pybullet

from drone_sim.mechanics.frames import Matrix, invert, multiply
from drone_sim.mechanics.state import Pose

_MAX_FORCE = 1e9  # N; PyBullet's default would let heavy bodies come apart
_TOLERANCE = 1e-6  # m and rotation matrix element; a smaller difference of a frame is rounding
WORLD = -1  # as a body's number


class Anchor(NamedTuple):
    """A frame on a link (-1: the root) of a body (-1: the world). `local` is link from frame."""

    body: int
    link: int
    local: Matrix


class RigidLinks:
    """The rigid links of one PyBullet client, by name."""

    def __init__(self, client: int):
        self._client = client
        self._made: dict[str, tuple[int, Anchor, Anchor]] = {}  # PyBullet's number of the constraint, and its ends

    def set(self, links: Mapping[str, tuple[Anchor, Anchor]]) -> None:
        """Hold these pairs of frames together from now on, and no others; frames that are apart are pulled together."""
        for name, (_, *ends) in [*self._made.items()]:
            if name not in links or not all(map(_is_same, ends, links[name])):
                self._release(name)
        for name, (first, second) in links.items():
            if name not in self._made:
                self._made[name] = self._create(first, second), first, second

    def forget(self, body: int) -> None:
        """Remove the links of a body that is about to be removed."""
        for name, (_, *ends) in [*self._made.items()]:
            if any(end.body == body for end in ends):
                self._release(name)

    def _create(self, first: Anchor, second: Anchor) -> int:
        if first.body == WORLD:
            first, second = second, first
        (position_1, quaternion_1), (position_2, quaternion_2) = self._in_inertial(first), self._in_inertial(second)
        number = pybullet.createConstraint(
            first.body, first.link, second.body, second.link, pybullet.JOINT_FIXED, (0, 0, 0),
            position_1, position_2, quaternion_1, quaternion_2, self._client,
        )  # fmt: skip
        pybullet.changeConstraint(number, maxForce=_MAX_FORCE, physicsClientId=self._client)
        return int(number)

    def _release(self, name: str) -> None:
        pybullet.removeConstraint(self._made.pop(name)[0], self._client)

    def _in_inertial(self, anchor: Anchor) -> Pose:
        """Return the frame in the inertial frame of its link, as PyBullet wants it."""
        local = anchor.local
        if anchor.body != WORLD:
            info = pybullet.getDynamicsInfo(anchor.body, anchor.link, self._client)
            local = multiply(invert(Pose(info[3], info[4]).matrix), local)
        return Pose.of(local)


def _is_same(old: Anchor, new: Anchor) -> bool:
    return old[:2] == new[:2] and all(abs(a - b) < _TOLERANCE for a, b in zip(old.local, new.local))
