"""Undoes movements that only try something, such as those of a path planner."""

from __future__ import annotations

from drone_sim.context import SimulationContext
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.vehicles.body import Body


def keep_places(context: SimulationContext) -> Restore:
    """Return a function that puts all objects and bodies back to the last bit; it may be called once."""
    states, objects = context.world.saved_states, context.objects
    number = states.snapshot()
    bodies = [body for body in (objects[handle].body for handle in objects) if isinstance(body, Body)]
    restore_objects = in_turn(objects.save_state(), *(saved(body, "teleports") for body in bodies))

    def restore() -> None:
        if states.has_snapshot(number):  # not after a body was added or removed
            states.restore(number)
            states.forget_snapshot(number)
        restore_objects()
        for body in bodies:
            body.refresh()
        context.carried.follow()

    return restore
