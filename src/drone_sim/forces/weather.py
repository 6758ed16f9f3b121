"""The weather of a scene: a steady wind, and gusts that drift with it. All vehicles are in one air.

A vehicle at the position p feels, at the time t, the steady wind U and the gust at the way V t - e p: e is the wind's
direction over ground, V its speed there. So who is further downwind meets the same gusts later, by its distance over V;
across the wind and upwards a gust is as wide as the world.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any

from pydantic import Field

from drone_sim.config.errors import changed
from drone_sim.config.types import Checked, Finite, Parts, Within
from drone_sim.forces.dryden import Gusts
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Vector

_BEFORE = 100.0  # m of gusts that have passed when a run begins: who is a bit downwind has some, too
_STILL: Vector = (0.0, 0.0, 0.0)

_Speed = Annotated[Finite, Within(-100, 100)]
_Deviation = Annotated[Finite, Within(0, 50)]
_Length = Annotated[Finite, Within(1, 1e4)]
_COMPONENTS = "3 numbers, [along the wind, across it, up]"
_PARTS = Parts(("along", "across", "up"))


class GustParameters(Checked):
    """Dryden's gusts (see forces.dryden); of deviation 0 there are none."""

    deviation: Annotated[tuple[_Deviation, _Deviation, _Deviation], _PARTS, Field(description=f"{_COMPONENTS} in m/s")]
    length: Annotated[tuple[_Length, _Length, _Length], _PARTS, Field(description=f"{_COMPONENTS} in m, 1 to 10000")]
    speed: Annotated[Finite, Within(0, 100)]
    seed: Annotated[int, Within(0, 2**63 - 1)]


class WeatherParameters(Checked):
    """What the air does."""

    wind: Annotated[
        tuple[_Speed, _Speed, _Speed],
        Parts(("x", "y", "z")),
        Field(description="3 numbers, [x, y, z] in m/s, in the world"),
    ]
    gusts: GustParameters


class Weather:
    """The air of one simulation. Without wind and gusts there is none to feel, until a change brings some.

    `changes` counts them.
    """

    def __init__(self, parameters: WeatherParameters, clock: Clock):
        """Begin as the parameters say, at the time of the simulation's clock."""
        self._parameters = parameters
        self._clock = clock
        self.changes = 0
        self._field: tuple[int, Gusts] | None = None  # the last one, and its seed
        self.reset()

    def reset(self) -> None:
        """Be as at the start of a run."""
        self.is_felt = any(self._parameters.wind) or any(self._parameters.gusts.deviation)
        self._passed, self._since = _BEFORE, 0.0
        self._be(self._parameters)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Lay other values over some of the present ones, as in YAML. Raises ParameterError."""
        new = changed(self.now, changes)
        time = self._clock.time
        self._passed, self._since = self._way(time), time
        self.is_felt = True
        self._be(new)
        self.changes += 1

    def _be(self, now: WeatherParameters) -> None:
        self.now = now
        x, y, _ = now.wind
        speed = math.hypot(x, y)
        self._along = (x / speed, y / speed) if speed else (1.0, 0.0)
        self._speed = max(speed, now.gusts.speed)
        self._gusts = self._gusts_of(now.gusts.seed) if any(now.gusts.deviation) else None

    def _gusts_of(self, seed: int) -> Gusts:
        if self._field is None or self._field[0] != seed:
            self._field = seed, Gusts(seed)
        return self._field[1]

    def _way(self, time: float) -> float:
        """Return how much of the gusts (m) has passed the world's origin."""
        return self._passed + self._speed * (time - self._since)

    def at(self, place: Vector) -> Vector:
        """Return the velocity of the air (m/s, world) at a place (m, world), now."""
        if not self.is_felt:
            return _STILL
        if self._gusts is None:
            return self.now.wind
        (ex, ey), (wx, wy, wz), own = self._along, self.now.wind, self.now.gusts
        way = self._way(self._clock.time) - ex * place[0] - ey * place[1]
        along, across, up = self._gusts.at(way, own.deviation, own.length)
        return wx + ex * along - ey * across, wy + ey * along + ex * across, wz + up

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back the present weather: gusts are a matter of seed, time and place."""
        now, felt, passed, since = self.now, self.is_felt, self._passed, self._since

        def restore() -> None:
            self.is_felt, self._passed, self._since = felt, passed, since
            self._be(now)
            self.changes += 1

        return restore
