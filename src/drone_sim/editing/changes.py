"""What an edit has changed of a scene, to be taken back, and to be done again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

from drone_sim.mechanics.object_tree import WORLD, levels
from drone_sim.run.scene_document import SceneContent
from drone_sim.run.scene_settings import Settings
from drone_sim.run.simulation import Simulation
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters

_Value = TypeVar("_Value")
_Pair = tuple[_Value | None, _Value | None]  # before, and after; None where it is not there
_DESCRIPTION = ("alias", "category", "model")
_PLACE = ("parent", "position", "rpy")


class SceneChange(NamedTuple):
    """What differs after an edit: objects by handle, scripts by the name of their object, settings."""

    entries: dict[int, _Pair[EntryParameters]]
    scripts: dict[str, _Pair[AttachedScriptParameters]]
    settings: tuple[Settings, Settings]

    @property
    def is_empty(self) -> bool:
        """Whether nothing has changed."""
        return not self.entries and not self.scripts and self.settings[0] == self.settings[1]

    @property
    def reversed(self) -> SceneChange:
        """What takes it back."""
        return SceneChange(_turned(self.entries), _turned(self.scripts), (self.settings[1], self.settings[0]))

    def followed_by(self, other: SceneChange) -> SceneChange:
        """Return both as one."""
        return SceneChange(
            _joined(self.entries, other.entries),
            _joined(self.scripts, other.scripts),
            (self.settings[0], other.settings[1]),
        )


def change_between(before: SceneContent, after: SceneContent) -> SceneChange:
    """Return what has changed."""
    return SceneChange(
        _differences(before.entries, after.entries),
        _differences(before.scripts, after.scripts),
        (before.settings, after.settings),
    )


_Key = TypeVar("_Key")


def _differences(before: Mapping[_Key, _Value], after: Mapping[_Key, _Value]) -> dict[_Key, _Pair[_Value]]:
    pairs = ((key, (before.get(key), after.get(key))) for key in {**before, **after})
    return {key: pair for key, pair in pairs if pair[0] is not pair[1] and pair[0] != pair[1]}


def _turned(pairs: Mapping[_Key, _Pair[_Value]]) -> dict[_Key, _Pair[_Value]]:
    return {key: (after, before) for key, (before, after) in pairs.items()}


def _joined(first: Mapping[_Key, _Pair[_Value]], second: Mapping[_Key, _Pair[_Value]]) -> dict[_Key, _Pair[_Value]]:
    pairs = {
        key: (first.get(key, second.get(key, (None, None)))[0], second.get(key, first.get(key, (None, None)))[1])
        for key in {**first, **second}
    }
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def carry_out(simulation: Simulation, change: SceneChange, arrange: Callable[[Settings], None]) -> None:
    """Apply a change to a scene that is in the state before it; `arrange` applies other settings.

    Raises ValueError, perhaps when a part of the change is done already.
    """
    _Changing(simulation, change).carry_out(arrange)


class _Changing:
    def __init__(self, simulation: Simulation, change: SceneChange):
        self._simulation = simulation
        self._change = change
        pairs = change.entries.items()
        self._gone = [handle for handle, (_, after) in pairs if after is None]
        self._new = {handle: after for handle, (before, after) in pairs if before is None and after is not None}
        self._other = {handle: (one, two) for handle, (one, two) in pairs if one is not None and two is not None}

    def carry_out(self, arrange: Callable[[Settings], None]) -> None:
        self._take_away()
        before, after = self._change.settings
        if before != after:
            arrange(after)
        self._rename({handle: two.name for handle, (one, two) in self._other.items() if one.name != two.name})
        if self._new:
            self._simulation.context.objects.reserve({one.name: handle for handle, one in self._new.items()})
            self._simulation.operations.add([*self._new.values()])
            self._simulation.scene.put_in_order()
        self._be()
        self._place()
        for name, (_, script) in self._change.scripts.items():
            if script is not None and self._simulation.scene.scripts.get(name) != script:
                self._simulation.operations.attach_script(script)

    def _take_away(self) -> None:
        operations = self._simulation.operations
        for name, (_, script) in self._change.scripts.items():
            if script is None:
                operations.detach_script(name)
        if self._gone:
            operations.remove(self._gone)

    def _rename(self, names: dict[int, str]) -> None:
        """Give names, also where some exchange theirs."""
        tree, operations = self._simulation.context.objects, self._simulation.operations
        while names:
            free = [handle for handle, name in names.items() if name not in tree]
            if not free:
                first = next(iter(names))
                operations.rename(first, operations.free_name(names[first]))
            for handle in free:
                operations.rename(handle, names.pop(handle))

    def _be(self) -> None:
        """Give entries their new content, all at once, so that the world is rebuilt only once."""
        operations, entries = self._simulation.operations, {}
        for handle, (one, two) in self._other.items():
            if type(one) is not type(two):
                self._replace(handle, two)
        for handle, (one, two) in self._other.items():
            if type(one) is type(two) and _others(one, two) - {"name", *_DESCRIPTION, *_PLACE}:
                now = operations.entry(handle)
                entries[handle] = two.model_copy(update={"name": now.name, "parent": now.parent})
        if entries:
            operations.exchange(entries)
        for handle, (one, two) in self._other.items():
            described = {key: getattr(two, key) for key in _DESCRIPTION if key in _others(one, two)}
            if described and type(one) is type(two):
                operations.describe(handle, **described)

    def _replace(self, handle: int, entry: EntryParameters) -> None:
        """Replace an object by one of another type, at the same place in the tree."""
        tree, operations = self._simulation.context.objects, self._simulation.operations
        children = [child for child, _ in tree.children(tree[handle])]
        script = self._simulation.scene.scripts.get(entry.name)
        operations.remove([handle])
        tree.reserve({entry.name: handle})
        operations.add([entry], [script] if script else [])
        for child in children:
            operations.set_parent(child, handle, keep_in_place=True)

    def _place(self) -> None:
        tree, operations = self._simulation.context.objects, self._simulation.operations
        hung = {handle: two for handle, (one, two) in self._other.items() if one.parent != two.parent}
        for handle in hung:  # on nothing first: two may change places
            operations.set_parent(handle, WORLD, keep_in_place=True)
        for handle, two in hung.items():
            if two.parent:
                operations.set_parent(handle, tree.handle(two.parent), keep_in_place=True)
        moved = [
            (handle, two)
            for handle, (one, two) in self._other.items()
            if any(getattr(one, key) != getattr(two, key) for key in _PLACE)
        ]
        for handle, two in sorted(moved, key=lambda one: levels(tree[one[0]])):
            operations.put(handle, two.local)


def _others(one: EntryParameters, two: EntryParameters) -> set[str]:
    """Return the keys in whose values two entries of one type differ."""
    return {key for key in type(two).model_fields if getattr(one, key, None) != getattr(two, key)}
