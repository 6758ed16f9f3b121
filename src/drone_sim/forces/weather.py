"""The weather of a scene: a steady wind, and gusts that drift with it. All vehicles share the same air.

At the time t a vehicle at the position p meets the steady wind U and the gust at the way V t - e p: e is the wind's
direction over ground, V its speed there. So a vehicle further downwind meets the same gusts later, by its distance
divided by V; across the wind and upwards a gust has no limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from drone_sim.config.errors import changed
from drone_sim.config.types import Checked, Finite, Parts, Within
from drone_sim.forces.dryden import Gusts
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.saved_state import Restore, in_turn, saved

_PASSED_AT_START = 100.0  # m of gusts, so that vehicles somewhat downwind meet gusts from the start
_STILL: Vector = (0.0, 0.0, 0.0)

_Speed = Annotated[Finite, Within(-100, 100)]
_Deviation = Annotated[Finite, Within(0, 50)]
_Length = Annotated[Finite, Within(1, 1e4)]
_COMPONENTS = "3 numbers, [along the wind, across it, up]"
_PARTS = Parts(("along", "across", "up"))


class GustParameters(Checked):
    """Dryden's gusts (see forces.dryden); a deviation of 0 means none."""

    deviation: Annotated[tuple[_Deviation, _Deviation, _Deviation], _PARTS, Field(description=f"{_COMPONENTS} in m/s")]
    length: Annotated[tuple[_Length, _Length, _Length], _PARTS, Field(description=f"{_COMPONENTS} in m, 1 to 10000")]
    speed: Annotated[Finite, Within(0, 100)]
    seed: Annotated[int, Within(0, 2**63 - 1)]


class WeatherParameters(Checked):
    """Wind and gusts."""

    wind: Annotated[
        tuple[_Speed, _Speed, _Speed],
        Parts(("x", "y", "z")),
        Field(description="3 numbers, [x, y, z] in m/s, in the world"),
    ]
    gusts: GustParameters


class Weather:
    """The air of one simulation. It has no effect without wind and gusts, until a change brings some.

    `changes` is the number of changes so far.
    """

    def __init__(self, parameters: WeatherParameters, clock: Clock):
        """Start with these parameters, at the time of the simulation's clock."""
        self._parameters = parameters
        self._clock = clock
        self.changes = 0
        self._cached_gusts: tuple[int, Gusts] | None = None  # the last gusts, and their seed
        self.reset()

    def reset(self) -> None:
        """Return to the state at the start of a run."""
        self.is_felt = any(self._parameters.wind) or any(self._parameters.gusts.deviation)
        self._passed, self._since = _PASSED_AT_START, 0.0
        self._apply(self._parameters)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Change some of the present values, as in YAML. Raises ParameterError."""
        new = changed(self.now, changes)
        time = self._clock.time
        self._passed, self._since = self._way(time), time
        self.is_felt = True
        self._apply(new)
        self.changes += 1

    def _apply(self, now: WeatherParameters) -> None:
        self.now = now
        x, y, _ = now.wind
        speed = math.hypot(x, y)
        self._along = (x / speed, y / speed) if speed else (1.0, 0.0)
        self._speed = max(speed, now.gusts.speed)
        self._wind, self._deviation, self._length = now.wind, now.gusts.deviation, now.gusts.length
        self._gusts = self._gusts_of(now.gusts.seed) if any(now.gusts.deviation) else None

    def _gusts_of(self, seed: int) -> Gusts:
        if self._cached_gusts is None or self._cached_gusts[0] != seed:
            self._cached_gusts = seed, Gusts(seed)
        return self._cached_gusts[1]

    def _way(self, time: float) -> float:
        """Return the way (m) of the gusts past the world's origin so far."""
        return self._passed + self._speed * (time - self._since)

    def at(self, place: Vector) -> Vector:
        """Return the present velocity of the air (m/s, world) at a place (m, world)."""
        if not self.is_felt:
            return _STILL
        if self._gusts is None:
            return self._wind
        (ex, ey), (wx, wy, wz) = self._along, self._wind
        way = self._way(self._clock.time) - ex * place[0] - ey * place[1]
        along, across, up = self._gusts.at(way, self._deviation, self._length)
        return wx + ex * along - ey * across, wy + ey * along + ex * across, wz + up

    def save_state(self) -> Restore:
        """Return a function that restores the weather; gusts depend on seed, time and place alone."""
        return in_turn(saved(self, "is_felt", "_passed", "_since"), partial(self._restore, self.now))

    def _restore(self, now: WeatherParameters) -> None:
        self._apply(now)
        self.changes += 1
