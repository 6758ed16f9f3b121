"""Entries of a scene in the order of their parents, and where they stand at the beginning."""

from __future__ import annotations

from collections.abc import Sequence

from drone_sim.mechanics.frames import IDENTITY, Matrix, from_rpy, multiply
from drone_sim.mechanics.joint import PRISMATIC
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.joint import JointParameters


def parents_first(entries: Sequence[EntryParameters]) -> list[int]:
    """Return the indices of entries, no parent after its children, else as they come. There is no circle among them."""
    index_of = {one.name: index for index, one in enumerate(entries) if one.name}
    ordered: dict[int, None] = {}
    for index in range(len(entries)):
        waiting: list[int] = []
        above: int | None = index
        while above is not None and above not in ordered:
            waiting.append(above)
            above = index_of.get(entries[above].parent)
        ordered.update((one, None) for one in reversed(waiting))
    return list(ordered)


def matrices(entries: Sequence[EntryParameters]) -> dict[int, Matrix]:
    """Return for each entry the world from its frame, as if what is no entry, a vehicle's object, were the world."""
    found: dict[int, Matrix] = {}
    index_of = {one.name: index for index, one in enumerate(entries) if one.name}
    for index in parents_first(entries):
        above = index_of.get(entries[index].parent)
        frame = IDENTITY if above is None else multiply(found[above], _motion(entries[above]))
        found[index] = multiply(frame, entries[index].local)
    return found


def _motion(one: EntryParameters) -> Matrix:
    if not isinstance(one, JointParameters):
        return IDENTITY
    if one.type == PRISMATIC:
        return from_rpy((0.0, 0.0, one.value), (0.0, 0.0, 0.0))
    return from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, one.value))
