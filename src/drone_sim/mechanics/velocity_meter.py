"""Velocities as V-REP measures them: from where an object was a step ago."""

from __future__ import annotations

import math
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved


class MeasuredVelocity(NamedTuple):
    """linear: m/s, world; euler: V-REP's Euler angles of the turn, in the object's frame before it, rad/s;
    rotation: the turn as a rotation vector, world, rad/s.
    """

    linear: Vector
    euler: Vector
    rotation: Vector


class VelocityMeter:
    """Measures vehicles, and what else somebody has asked about: their mean velocities over the last step.

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
        self._measured: dict[int, MeasuredVelocity] = {}  # of this step, as far as asked for

    def follow(self, handle: int) -> None:
        """Measure an object from now on, before anybody asks."""
        self._now.setdefault(handle, self._objects[handle].matrix())

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

    def velocity(self, handle: int) -> MeasuredVelocity:
        """Return the velocities; of what was put elsewhere since, and at first, those of the dynamics.

        Raises ValueError.
        """
        found = self._objects[handle]
        matrix = found.matrix()
        if handle not in self._now:
            self._begin(handle, matrix)
        if handle not in self._before or matrix != self._now[handle]:
            linear, angular = found.velocity()
            return MeasuredVelocity(linear, frames.rotate(frames.invert(matrix), angular), angular)
        if handle not in self._measured:
            self._measured[handle] = _mean(self._before[handle], self._now[handle], self._clock.time_step)
        return self._measured[handle]

    def _begin(self, handle: int, now: Matrix) -> None:
        """Measure one more object, which was carried through the last step like what it hangs on."""
        above = self._objects[handle].parent
        while above is not None:
            carrier = self._objects.handle_of(above)
            if carrier in self._before:
                local = frames.relative(self._now[carrier], now)
                self._before[handle] = frames.multiply(self._before[carrier], local)
                break
            above = above.parent
        self._now[handle] = now

    def save_state(self) -> Restore:
        """Return a function that brings back what has been measured."""
        return saved(self, "_before", "_now", "_measured")


def _mean(before: Matrix, now: Matrix, duration: float) -> MeasuredVelocity:
    turn = frames.relative_turn(before, now)
    x, y, z, w = frames.to_quaternion(turn)
    sine = math.sqrt(x * x + y * y + z * z)
    scale = (2 * math.atan2(sine, w) / sine if sine else 2.0) / duration
    linear = (now[3] - before[3]) / duration, (now[7] - before[7]) / duration, (now[11] - before[11]) / duration
    alpha, beta, gamma = frames.to_euler(turn)
    euler = alpha / duration, beta / duration, gamma / duration
    return MeasuredVelocity(linear, euler, frames.rotate(before, (x * scale, y * scale, z * scale)))
