"""A path of V-REP 3.x: control points with rounded corners."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Finite, ParameterError, Point, Switch, Unit, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics.controlled_path import METRES_PER_RADIAN, ControlledPath, PathRules
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.kinds.kind import KindParameters, Place
from drone_sim.scene.kinds.path import MAX_POINTS, Turn

MAX_LINE = 100_000  # points of all curves of a path
LONGEST = 1e6  # m
FACTORS, COUNTS = (0.1, 0.99), (1, 100)
_Factor = Annotated[Finite, Within(*FACTORS)]
_Metres = Annotated[Finite, Within(1e-4, 1e3)]  # m
_Pause = Annotated[Finite, Within(0, 1e3)]  # m


class ControlPointParameters(Checked):
    """A control point: `turn` is its quaternion x, y, z, w; its corner is a curve of `count` points (1: no curve).

    `factors`: fractions of the distances to the middles of the two adjacent segments that the curve covers; `pause`:
    duration of a stop, expressed in m; getDataOnPath returns `flags` and `channels`.
    """

    position: Point
    turn: Turn = (0.0, 0.0, 0.0, 1.0)
    factors: tuple[_Factor, _Factor] = (0.5, 0.5)
    count: Annotated[int, Within(*COUNTS)] = 15
    pause: _Pause = 0.0
    flags: Annotated[int, Within(0, 65535)] = 0
    channels: tuple[Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0)

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError for a quaternion that is not unit."""
        super().model_post_init(context)
        if abs(math.hypot(*self.turn) - 1.0) > 1e-3:
            raise ParameterError("must be a unit quaternion x, y, z, w", ("turn",))

    @property
    def control_point(self) -> ControlPoint:
        """The control point for ControlledPath."""
        station = Station(self.position, self.turn, self.pause, self.flags, self.channels)
        return ControlPoint(station, *self.factors, self.count)


class CurvedPathParameters(KindParameters):
    """A path through zero or more control points in its own frame; `closed`: the last is joined to the first.

    orientation: `own` uses that of the control points, `automatic` points z along the path, `x_up` also has x upwards;
    flat: points that scripts add are at z = 0; counts: how the length is calculated (sim.distcalcmethod_...), with
    `metres_per_radian` for rotations and `metres_per_pause` for pauses; along: initial value of getPathPosition (m).
    """

    kind: Literal["curved_path"]
    control_points: Annotated[list[ControlPointParameters], Field(max_length=MAX_POINTS)]
    closed: Switch = False
    orientation: Literal["own", "automatic", "x_up"] = "automatic"
    flat: Switch = False
    counts: Literal["dl", "dac", "max_dl_dac", "dl_and_dac", "sqrt_dl2_and_dac2", "dl_if_nonzero", "dac_if_nonzero"] = (
        "dl_if_nonzero"
    )
    metres_per_radian: _Metres = METRES_PER_RADIAN
    metres_per_pause: _Metres = 1.0
    along: Annotated[Finite, Within(0, LONGEST), Unit("m")] = 0.0

    def model_post_init(self, context: Any) -> None:
        """Raise ParameterError if the curves have too many points."""
        super().model_post_init(context)
        count = sum(point.count for point in self.control_points)
        if count > MAX_LINE:
            raise ParameterError(f"the curves have {count} points, at most {MAX_LINE} are allowed", ("control_points",))

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        counts = self.counts, self.metres_per_radian, self.metres_per_pause
        rules = PathRules(self.closed, self.flat, self.orientation, *counts)
        path = ControlledPath(*place, [point.control_point for point in self.control_points], rules)
        path.position_along = self.along
        return path
