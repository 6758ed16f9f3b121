"""Velocities as V-REP measures them: from where an object was a step ago."""

from __future__ import annotations

import math

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved

Velocity = tuple[Vector, Vector]  # m/s and rad/s, world frame
_SMALL = 1e-12  # of the sine of half an angle


class VelocityMeter:
    """Measures the objects that somebody has asked about: their mean velocities over the last step.

    What a script or a person puts elsewhere has not moved there, if the dynamics moves it or what carries it: only what
    happens between `begin_step` and `end_step` counts. All else moves whenever it is put.
    """

    def __init__(self, objects: ObjectTree, clock: Clock):
        """Take the objects, and the simulation's clock."""
        self._objects, self._clock = objects, clock
        self.clear()

    def clear(self) -> None:
        """Measure nothing yet."""
        self._before: dict[int, Matrix] = {}  # world from object, by handle
        self._now: dict[int, Matrix] = {}
        self._measured: dict[int, Velocity] = {}  # of this step, as far as asked for

    def begin_step(self) -> None:
        """Look where everything is that the dynamics is about to move."""
        for handle in list(self._now):
            if not self._objects.has(handle):
                del self._now[handle]
            elif self._objects[handle].carrier is not None:
                self._now[handle] = self._objects[handle].matrix()

    def end_step(self) -> None:
        """Look where everything is after it."""
        if self._now:
            self._before, self._measured = self._now, {}
            self._now = {handle: self._objects[handle].matrix() for handle in self._now}

    def velocity(self, handle: int) -> Velocity:
        """Return linear and angular velocity; the first time in a run, those that the dynamics has reached.

        The angular velocity is the turn of the step as a rotation vector, over the step. Raises ValueError.
        """
        found = self._objects[handle]
        self._now.setdefault(handle, found.matrix())
        if handle not in self._before:
            return found.velocity()
        if handle not in self._measured:
            self._measured[handle] = _mean(self._before[handle], self._now[handle], self._clock.time_step)
        return self._measured[handle]

    def save_state(self) -> Restore:
        """Return a function that brings back what has been measured."""
        return saved(self, "_before", "_now", "_measured")


def _mean(before: Matrix, now: Matrix, duration: float) -> Velocity:
    x, y, z, w = frames.to_quaternion(frames.relative_turn(before, now))
    sine = math.sqrt(x * x + y * y + z * z)
    scale = (2 * math.atan2(sine, w) / sine if sine > _SMALL else 2.0) / duration
    linear = (now[3] - before[3]) / duration, (now[7] - before[7]) / duration, (now[11] - before[11]) / duration
    return linear, frames.rotate(before, (x * scale, y * scale, z * scale))
