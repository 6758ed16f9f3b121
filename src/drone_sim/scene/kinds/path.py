"""A path of straight segments that scripts follow."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Finite, ParameterError, Point, Switch
from drone_sim.context import SimulationContext
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place

MAX_POINTS = 10_000
Turn = tuple[Finite, Finite, Finite, Finite]


class PathParameters(KindParameters):
    """A path of straight segments; `points` in its own frame; `closed`: the last is joined to the first.

    `turns` are the points' quaternions x, y, z, w, for scripts that read them; by default they look along the path.
    """

    kind: Literal["path"]
    points: Annotated[list[Point], Field(min_length=2, max_length=MAX_POINTS)]
    closed: Switch = False
    turns: Annotated[tuple[Turn, ...], Field(max_length=MAX_POINTS)] = ()

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError for quaternions that are not unit, or not one for each point."""
        super().model_post_init(context)
        if self.turns and len(self.turns) != len(self.points):
            raise ParameterError(
                f"{len(self.turns)} quaternions for {len(self.points)} points: must be one for each point", ("turns",)
            )
        if any(abs(math.hypot(*quaternion) - 1.0) > 1e-3 for quaternion in self.turns):
            raise ParameterError("each must be a unit quaternion x, y, z, w", ("turns",))

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return Path(*place, self.points, self.closed, self.turns)
