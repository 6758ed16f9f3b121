"""A path of V-REP 3.x: control points, whose corners are curves."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Finite, ParameterError, Point, Switch, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics.controlled_path import METRES_PER_RADIAN, ControlledPath, PathRules
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place
from drone_sim.scene.kinds.path import MAX_POINTS, Turn

MAX_LINE = 100_000  # points of the whole line
LONGEST = 1e6  # m
FACTORS, COUNTS = (0.1, 0.99), (1, 100)
_Factor = Annotated[Finite, Within(*FACTORS)]
_Much = Annotated[Finite, Within(1e-4, 1e3)]  # m
_Pause = Annotated[Finite, Within(0, 1e3)]  # m


class ControlPointParameters(Checked):
    """A control point: `turn` is its quaternion x, y, z, w, and its corner a curve of `count` points, 1 without one.

    `factors`: which shares of the ways to the middles of both pieces the curve takes; `pause`: how long one stands
    there, as m; `flags` and `channels`: what getDataOnPath finds.
    """

    position: Point
    turn: Turn = (0.0, 0.0, 0.0, 1.0)
    factors: tuple[_Factor, _Factor] = (0.5, 0.5)
    count: Annotated[int, Within(*COUNTS)] = 15
    pause: _Pause = 0.0
    flags: Annotated[int, Within(0, 65535)] = 0
    channels: tuple[Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0)

    def model_post_init(self, context: Any) -> None:
        """Refuse a quaternion that is no rotation."""
        super().model_post_init(context)
        if abs(math.hypot(*self.turn) - 1.0) > 1e-3:
            raise ParameterError("must be a unit quaternion x, y, z, w", ("turn",))

    @property
    def control_point(self) -> ControlPoint:
        """The same for the path."""
        at = Station(self.position, self.turn, self.pause, self.flags, self.channels)
        return ControlPoint(at, *self.factors, self.count)


class CurvedPathParameters(KindParameters):
    """A path through control points, perhaps none, in its own frame; `closed`: from the last one back to the first.

    orientation: `own` is that of the control points; `automatic` looks along z, `x_up` with x upwards; flat: points
    that scripts add are at z = 0; counts: what its length is (sim.distcalcmethod_...), where a turn is
    `metres_per_radian` and a pause `metres_per_pause`; along: what getPathPosition returns at the beginning, m.
    """

    kind: Literal["curved_path"]
    control_points: Annotated[list[ControlPointParameters], Field(max_length=MAX_POINTS)]
    closed: Switch = False
    orientation: Literal["own", "automatic", "x_up"] = "automatic"
    flat: Switch = False
    counts: Literal["dl", "dac", "max_dl_dac", "dl_and_dac", "sqrt_dl2_and_dac2", "dl_if_nonzero", "dac_if_nonzero"] = (
        "dl_if_nonzero"
    )
    metres_per_radian: _Much = METRES_PER_RADIAN
    metres_per_pause: _Much = 1.0
    along: Annotated[Finite, Within(0, LONGEST)] = 0.0

    def model_post_init(self, context: Any) -> None:
        """Refuse more curves than can be kept."""
        super().model_post_init(context)
        most = sum(one.count for one in self.control_points)
        if most > MAX_LINE:
            raise ParameterError(f"the curves have {most} points, at most {MAX_LINE} are allowed", ("control_points",))

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the path."""
        counts = self.counts, self.metres_per_radian, self.metres_per_pause
        rules = PathRules(self.closed, self.flat, self.orientation, *counts)
        made = ControlledPath(*place, [one.control_point for one in self.control_points], rules)
        made.position_along = self.along
        return made
