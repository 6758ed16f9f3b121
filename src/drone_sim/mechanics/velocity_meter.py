"""Velocities measured as in V-REP: from the change of an object's pose over the last step."""

from __future__ import annotations

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved


class VelocityMeter:
    """Measures mean velocities over the last step, of vehicles and of every object whose velocity was requested.

    For objects that the dynamics moves or carries, only motion between `begin_step` and `end_step` counts; placing them
    elsewhere, by a script or a person, does not. For all other objects that counts as motion, too.
    """

    def __init__(self, objects: ObjectTree, clock: Clock):
        """Measure the objects of a tree, by the simulation's clock."""
        self._objects, self._clock = objects, clock
        self.clear()

    def clear(self) -> None:
        """Forget all objects and measurements."""
        self._before: dict[int, Matrix] = {}  # world from object, by handle
        self._now: dict[int, Matrix] = {}

    def follow(self, handle: int) -> None:
        """Measure an object from now on, even before its velocity is read."""
        self._now.setdefault(handle, self._objects[handle].matrix())

    def begin_step(self) -> None:
        """Record the poses of the objects that the dynamics is about to move."""
        objects = self._objects.by_handle
        for handle, last in list(self._now.items()):
            item = objects.get(handle)
            if item is None:
                del self._now[handle]
            elif (matrix := item.matrix()) is not last and item.carrier is not None:
                self._now[handle] = matrix

    def end_step(self) -> None:
        """Record the poses after the step."""
        if self._now:
            objects, self._before = self._objects.by_handle, self._now
            self._now = {handle: objects[handle].matrix() for handle in self._now}

    def velocity(self, handle: int) -> tuple[Vector, Vector]:
        """Return linear (m/s, world) and angular velocity (rad/s): Euler angles of the step's rotation, per second.

        The angles refer to the object's frame before the step. For an object that was placed elsewhere since, or is new
        to the meter, both are the present velocities in the dynamics. Raises ValueError for an unknown handle.
        """
        rotation = self._rotation_over_step(handle)
        if rotation is None:
            linear, angular = self._objects[handle].velocity()
            return linear, frames.rotate(frames.invert(self._objects[handle].matrix()), angular)
        before, now, duration = self._before[handle], self._now[handle], self._clock.time_step
        alpha, beta, gamma = frames.to_euler(rotation)
        linear = (now[3] - before[3]) / duration, (now[7] - before[7]) / duration, (now[11] - before[11]) / duration
        return linear, (alpha / duration, beta / duration, gamma / duration)

    def rotation(self, handle: int) -> Vector:
        """Return the step's rotation vector per second (rad/s, world). Raises ValueError for an unknown handle."""
        rotation = self._rotation_over_step(handle)
        if rotation is None:
            return self._objects[handle].velocity()[1]
        x, y, z = frames.rotate(self._before[handle], frames.rotation_vector(rotation))
        duration = self._clock.time_step
        return x / duration, y / duration, z / duration

    def _rotation_over_step(self, handle: int) -> Matrix | None:
        """Return how an object rotated over the step, None if that is unknown."""
        matrix = self._objects.by_handle[handle].matrix()
        if handle not in self._now:
            self._begin_to_measure(handle, matrix)
        before = self._before.get(handle)
        now = self._now[handle]
        is_moved = matrix is not now and matrix != now
        return None if before is None or is_moved else frames.relative_turn(before, matrix)

    def _begin_to_measure(self, handle: int, now: Matrix) -> None:
        """Measure one more object, as if its carrier had moved it through the last step."""
        ancestor = self._objects[handle].parent
        while ancestor is not None:
            carrier = self._objects.handle_of(ancestor)
            if carrier in self._before:
                local = frames.relative(self._now[carrier], now)
                self._before[handle] = frames.multiply(self._before[carrier], local)
                break
            ancestor = ancestor.parent
        self._now[handle] = now

    def save_state(self) -> Restore:
        return saved(self, "_before", "_now")
