"""Velocities as V-REP measures them: from where an object was a step ago."""

from __future__ import annotations

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved


class VelocityMeter:
    """Measures vehicles, and what else somebody has asked about: their mean velocities over the last step.

    For objects that the dynamics moves or carries, only motion between `begin_step` and `end_step` counts, not being
    put elsewhere by a script or a person. For all others, being put elsewhere counts as motion, too.
    """

    def __init__(self, objects: ObjectTree, clock: Clock):
        """Take the objects, and the simulation's clock."""
        self._objects, self._clock = objects, clock
        self.clear()

    def clear(self) -> None:
        """Measure nothing yet."""
        self._before: dict[int, Matrix] = {}  # world from object, by handle
        self._now: dict[int, Matrix] = {}

    def follow(self, handle: int) -> None:
        """Measure an object from now on, before anybody asks."""
        self._now.setdefault(handle, self._objects[handle].matrix())

    def begin_step(self) -> None:
        """Look where everything is that the dynamics is about to move."""
        for handle, last in list(self._now.items()):
            one = self._objects.get(handle)
            if one is None:
                del self._now[handle]
            elif (matrix := one.matrix()) is not last and one.carrier is not None:
                self._now[handle] = matrix

    def end_step(self) -> None:
        """Look where everything is after it."""
        if self._now:
            self._before = self._now
            self._now = {handle: self._objects[handle].matrix() for handle in self._now}

    def velocity(self, handle: int) -> tuple[Vector, Vector]:
        """Return linear (m/s, world) and angular velocity (rad/s): the Euler angles of the turn over the step.

        They are of the object's own frame before it. Of what was put elsewhere since, and at first, both are those that
        the dynamics has reached. Raises ValueError.
        """
        turn = self._turn(handle)
        if turn is None:
            linear, angular = self._objects[handle].velocity()
            return linear, frames.rotate(frames.invert(self._objects[handle].matrix()), angular)
        before, now, duration = self._before[handle], self._now[handle], self._clock.time_step
        alpha, beta, gamma = frames.to_euler(turn)
        linear = (now[3] - before[3]) / duration, (now[7] - before[7]) / duration, (now[11] - before[11]) / duration
        return linear, (alpha / duration, beta / duration, gamma / duration)

    def rotation(self, handle: int) -> Vector:
        """Return the turn over the step as a rotation vector in the world (rad/s). Raises ValueError."""
        turn = self._turn(handle)
        if turn is None:
            return self._objects[handle].velocity()[1]
        x, y, z = frames.rotate(self._before[handle], frames.rotation_vector(turn))
        duration = self._clock.time_step
        return x / duration, y / duration, z / duration

    def _turn(self, handle: int) -> Matrix | None:
        """Return how it has turned within the step, None where nobody knows."""
        matrix = self._objects[handle].matrix()
        if handle not in self._now:
            self._begin(handle, matrix)
        before = self._before.get(handle)
        return None if before is None or matrix != self._now[handle] else frames.relative_turn(before, matrix)

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
        return saved(self, "_before", "_now")
