"""A path: points that scripts follow."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drone_sim.config.types import Point, Switch
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import Around, KindParameters, Place

MAX_POINTS = 10_000


class PathParameters(KindParameters):
    """A path of straight pieces; `points` in its own frame; `closed`: from the last one back to the first."""

    kind: Literal["path"]
    points: Annotated[list[Point], Field(min_length=2, max_length=MAX_POINTS)]
    closed: Switch = False

    def make(self, place: Place, around: Around) -> SceneObject:
        """Return the path."""
        return Path(*place, self.points, self.closed)
