"""A timeline's entries that put an object of the scene somewhere else."""

from __future__ import annotations

from typing import NamedTuple

from drone_sim.mechanics.frames import Vector, from_rpy, to_rpy
from drone_sim.mechanics.object_tree import WORLD, ObjectTree


class ObjectMove(NamedTuple):
    """Where an object is to be (m, rad, world); without angles it stays turned as it is."""

    name: str  # as scripts find it
    position: Vector
    rpy: Vector | None

    def apply(self, objects: ObjectTree) -> None:
        """Put it there, with all that hangs on it. Raises ValueError where there is no such object."""
        handle = objects.handle(self.name)
        rpy = to_rpy(objects.matrix(handle)) if self.rpy is None else self.rpy
        objects.set_matrix(handle, WORLD, from_rpy(self.position, rpy))
