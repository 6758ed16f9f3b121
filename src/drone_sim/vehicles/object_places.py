"""What a vehicle's objects are called in the file that it comes from, and where they are."""

from __future__ import annotations

from drone_sim.config.types import Angles, Checked, Label, Point
from drone_sim.mechanics.frames import Matrix, from_rpy


class ObjectPlace(Checked):
    """Another name, to which no suffix is added, alias, parent ('' is the world), and place (m, rad) in its frame."""

    name: Label = ""
    alias: Label = ""
    parent: Label | None = None
    position: Point | None = None
    rpy: Angles | None = None

    def local(self, default: Matrix) -> Matrix:
        """Return the parent's frame from its own: as given, or the default."""
        if self.position is None and self.rpy is None:
            return default
        return from_rpy(self.position or (0.0, 0.0, 0.0), self.rpy or (0.0, 0.0, 0.0))


NOWHERE_ELSE = ObjectPlace()
