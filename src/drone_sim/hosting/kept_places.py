"""Undoes movements that only try something, such as those of a path planner."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from drone_sim.context import SimulationContext
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.vehicles.body import Body


def keep_places(context: SimulationContext, handles: Collection[int] | None) -> Restore:
    """Return a function that puts all objects and bodies back to the last bit; it may be called once.

    `handles`: the objects that will move, with their descendants; None: any object may.
    """
    states, objects = context.world.saved_states, context.objects
    # A snapshot copies every mesh, so it is taken only if bodies move that the dynamics moves.
    number = states.snapshot() if handles is None or any(_are_dynamic(objects, handles)) else None
    bodies = [body for body in (objects[handle].body for handle in objects) if isinstance(body, Body)]
    restore_objects = in_turn(objects.save_state(), *(saved(body, "teleports") for body in bodies))

    def restore() -> None:
        if number is not None and states.has_snapshot(number):  # not after a body was added or removed
            states.restore(number)
            states.forget_snapshot(number)
        restore_objects()
        for body in bodies:
            body.refresh()
        context.carried.follow()

    return restore


def _are_dynamic(objects: ObjectTree, handles: Collection[int]) -> Iterator[bool]:
    """Yield for objects and their descendants whether the dynamics moves them."""
    moved = [objects[handle] for handle in handles]
    for item in map(objects.__getitem__, objects):
        if item in moved or any(item.is_descendant_of(other) for other in moved):
            yield item.body is not None or (isinstance(item, Joint) and item.drive is not None)
