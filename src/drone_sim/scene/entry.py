"""What all entries of `objects` have in common: a name, a parent, a place in the parent's frame."""

from __future__ import annotations

from typing import Any, NamedTuple

from drone_sim.config.types import Angles, Checked, Label, ParameterError, Point
from drone_sim.mechanics.frames import Matrix, from_rpy, to_quaternion
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose


class Place(NamedTuple):
    """Where an object belongs in the tree."""

    names: tuple[str, ...]
    alias: str
    parent: SceneObject | None
    local: Matrix


class EntryParameters(Checked):
    """An entry; `position` (m) and `rpy` (rad) are in the frame of the object named `parent`, '' the world.

    No other object has its `name` (V-REP 3.x); siblings may share the `alias` (4.x), which is the name where none is
    given.
    """

    name: Label = ""
    alias: Label = ""
    parent: Label = ""
    position: Point
    rpy: Angles = (0.0, 0.0, 0.0)

    def model_post_init(self, _context: Any) -> None:
        """Refuse what scripts could not find under a name."""
        if (self.parent or self.alias) and not self.name:
            key, value = ("parent", self.parent) if self.parent else ("alias", self.alias)
            raise ParameterError(f"{key} = '{value}': what has one needs a `name`, too")

    @property
    def pose(self) -> Pose:
        """Where it stands in its parent's frame."""
        x, y, z = self.position
        return Pose((x, y, z), to_quaternion(from_rpy((0, 0, 0), self.rpy)))

    @property
    def local(self) -> Matrix:
        """Its parent's frame from its own."""
        return from_rpy(self.position, self.rpy)

    @property
    def shown(self) -> str:
        """What 4.x paths call it."""
        return self.alias or self.name
