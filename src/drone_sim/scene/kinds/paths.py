"""Paths that scripts follow: of straight segments, and V-REP 3.x's of control points with rounded corners."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.types import Checked, Finite, ParameterError, Point, Switch, Unit, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics.path import METRES_PER_RADIAN, ControlledPath, Path, PathRules
from drone_sim.mechanics.path_curves import ControlPoint, Station
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.entry import KindParameters, Place

_MAX_POINTS = 10_000
_Turn = tuple[Finite, Finite, Finite, Finite]
MAX_LINE = 100_000  # points of all curves of a path
LONGEST = 1e6  # m
FACTORS, COUNTS = (0.1, 0.99), (1, 100)
_Factor = Annotated[Finite, Within(*FACTORS)]
_Metres = Annotated[Finite, Within(1e-4, 1e3)]  # m
_Pause = Annotated[Finite, Within(0, 1e3)]  # m


class PathParameters(KindParameters):
    """A path of straight segments; `points` in its own frame; `closed`: the last is joined to the first.

    `turns` are the points' quaternions x, y, z, w, for scripts that read them; by default they look along the path.
    """

    kind: Literal["path"]
    points: Annotated[list[Point], Field(min_length=2, max_length=_MAX_POINTS)]
    closed: Switch = False
    turns: Annotated[tuple[_Turn, ...], Field(max_length=_MAX_POINTS)] = ()

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


class ControlPointParameters(Checked):
    """A control point: `turn` is its quaternion x, y, z, w; its corner is a curve of `count` points (1: no curve).

    `factors`: fractions of the distances to the middles of the two adjacent segments that the curve covers; `pause`:
    duration of a stop, expressed in m; getDataOnPath returns `flags` and `channels`.
    """

    position: Point
    turn: _Turn = (0.0, 0.0, 0.0, 1.0)
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
        station = Station(self.position, self.turn, self.pause, self.flags, self.channels)
        return ControlPoint(station, *self.factors, self.count)


class CurvedPathParameters(KindParameters):
    """A path through zero or more control points in its own frame; `closed`: the last is joined to the first.

    orientation: `own` uses that of the control points, `automatic` points z along the path, `x_up` also has x upwards;
    flat: points that scripts add are at z = 0; counts: how the length is calculated (sim.distcalcmethod_...), with
    `metres_per_radian` for rotations and `metres_per_pause` for pauses; along: initial value of getPathPosition (m).
    """

    kind: Literal["curved_path"]
    control_points: Annotated[list[ControlPointParameters], Field(max_length=_MAX_POINTS)]
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
