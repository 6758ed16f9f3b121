"""Objects that are only a frame: dummies, which may be linked to each other, and script objects.

The dynamics keeps the bodies that carry two linked dummies rigidly together, as in V-REP.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from drone_sim.config.types import Label, Length, ParameterError, Switch
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import LinkBody, ShapeObject
from drone_sim.scene.entry import EntryParameters, KindParameters, Place
from drone_sim.world import World
from drone_sim.world.rigid_links import WORLD, Anchor


class ScriptParameters(KindParameters):
    """A script object of CoppeliaSim 4.9 and later: a child frame of the scripted object, for paths to the script.

    The script itself is an entry of `scripts`, attached to this object's parent.
    """

    kind: Literal["script"]

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return SceneObject(*place, kind="script")


class DummyParameters(KindParameters):
    """A dummy; `size` (m) is the diameter of its ball in rviz.

    `linked`: name of another dummy; the dynamics keeps the bodies that carry the two rigidly together. `part`: it is a
    part of the body that carries it, so that its distances and collisions are those of that body.
    """

    kind: Literal["dummy"]
    size: Length = 0.01
    linked: Label = ""
    part: Switch = False

    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        return Dummy(place, self.size, self.part)


class Dummy(SceneObject):
    """A frame with a display size."""

    def __init__(self, place: Place, size: float, is_part: bool):
        """Create the dummy; `size` in m. `is_part`: of the body that carries it."""
        super().__init__(*place, kind="dummy")
        self.size, self.is_part = size, is_part


def check_links(objects: Iterable[EntryParameters]) -> None:
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
        self.pairs: list[tuple[SceneObject, SceneObject]] = []
        self.is_stale = True  # whether `find` must be called, because an entry or object has changed

    def find(self, objects: Iterable[tuple[EntryParameters, SceneObject | None]]) -> None:
        """Find the pairs of linked dummies among entries and their objects."""
        dummies = [(entry, item) for entry, item in objects if isinstance(entry, DummyParameters)]
        by_name = {entry.name: item for entry, item in dummies}
        pairs = {}
        for entry, item in dummies:
            other = by_name.get(entry.linked)
            if item is not None and other is not None:
                pairs[frozenset((entry.name, entry.linked))] = item, other
        self.pairs = [*pairs.values()]
        self.is_stale = False
        if not pairs:
            self._world.rigid_links.set({})

    def hold(self) -> None:
        """Update the links in the world to where the linked dummies are on their bodies."""
        links = {}
        for first, second in self.pairs:
            ends = _anchor(first), _anchor(second)
            if ends[0][:2] != ends[1][:2] and (first.carrier is not None or second.carrier is not None):
                links[first.name] = ends
        self._world.rigid_links.set(links)


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
