"""Links of dummies: the dynamics keeps the bodies that carry two linked dummies rigidly together, as in V-REP."""

from __future__ import annotations

from collections.abc import Iterable

from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import LinkBody, ShapeObject
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds.dummy import DummyParameters
from drone_sim.scene.object_record import ObjectRecord
from drone_sim.world import World
from drone_sim.world.rigid_links import WORLD, Anchor


def check(objects: Iterable[EntryParameters]) -> None:
    """Raise ParameterError for a link to an object that is no dummy, and for a dummy with two links."""
    dummies = {entry.name: entry for entry in objects if isinstance(entry, DummyParameters)}
    linked: set[str] = set()
    for index, entry in enumerate(objects):
        if not isinstance(entry, DummyParameters) or not entry.linked:
            continue
        where, value = ("objects", index, "linked"), f"'{entry.linked}'"
        if entry.linked not in dummies or entry.linked == entry.name:
            raise ParameterError("must be the name of another dummy", where, value)
        if dummies[entry.linked].linked == entry.name:
            continue  # both say so
        if {entry.name, entry.linked} & linked:
            raise ParameterError(f"'{entry.name}' or this dummy is linked to a third one", where, value)
        linked |= {entry.name, entry.linked}


class DummyLinks:
    """The linked dummies of a scene, and their links in the world."""

    def __init__(self, world: World):
        self._world = world
        self._pairs: list[tuple[SceneObject, SceneObject]] = []
        self.is_stale = True  # set it when a record has changed

    def hold(self, records: Iterable[ObjectRecord]) -> None:
        """Update the links in the world to where the linked dummies of `records` are on their bodies."""
        if self.is_stale:
            self._find(records)
        if not self._pairs:
            return
        links = {}
        for first, second in self._pairs:
            ends = _anchor(first), _anchor(second)
            if ends[0][:2] != ends[1][:2] and (first.carrier is not None or second.carrier is not None):
                links[first.name] = ends
        self._world.rigid_links.set(links)

    def _find(self, records: Iterable[ObjectRecord]) -> None:
        dummies = [(item.entry, item.item) for item in records if isinstance(item.entry, DummyParameters)]
        linking = [(entry, item) for entry, item in dummies if entry.linked]
        objects = {entry.name: item for entry, item in dummies} if linking else {}
        pairs = {}
        for entry, item in linking:
            other = objects.get(entry.linked)
            if item is not None and other is not None:
                pairs[frozenset((entry.name, entry.linked))] = item, other
        self._pairs = [*pairs.values()]
        self.is_stale = False
        if not pairs:
            self._world.rigid_links.set({})


def _anchor(dummy: SceneObject) -> Anchor:
    """Return the dummy's frame on the body of its nearest ancestor that has one."""
    bearer = dummy.parent
    while bearer is not None and bearer.body is None and not isinstance(bearer, ShapeObject):
        bearer = bearer.parent
    if bearer is None:
        return Anchor(WORLD, WORLD, dummy.matrix())
    local = frames.relative(bearer.matrix(), dummy.matrix())
    if isinstance(bearer, ShapeObject):
        link_from_shape = bearer.body.local if isinstance(bearer.body, LinkBody) else IDENTITY
        return Anchor(bearer.number, bearer.link, frames.multiply(link_from_shape, local))
    return Anchor(getattr(bearer.body, "number"), -1, local)  # noqa: B009
