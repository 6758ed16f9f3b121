"""Changes of a scene by an edit, which can be undone and redone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

from drone_sim.mechanics.object_tree import WORLD, levels
from drone_sim.run.scene_document import SceneContent
from drone_sim.run.scene_settings import Settings
from drone_sim.run.simulation import Simulation
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

_Value = TypeVar("_Value")
_Pair = tuple[_Value | None, _Value | None]  # before and after; None if absent
_DESCRIPTION_KEYS = ("alias", "category", "model")
_POSE_KEYS = ("parent", "position", "rpy")


class SceneChange(NamedTuple):
    """The differences made by an edit: objects by handle, scripts by the name of their object, and settings."""

    entries: dict[int, _Pair[EntryParameters]]
    scripts: dict[str, _Pair[AttachedScriptParameters]]
    settings: tuple[Settings, Settings]

    @property
    def is_empty(self) -> bool:
        """Whether nothing has changed."""
        return not self.entries and not self.scripts and self.settings[0] == self.settings[1]

    @property
    def reversed(self) -> SceneChange:
        """The change that undoes this one."""
        return SceneChange(_swapped(self.entries), _swapped(self.scripts), (self.settings[1], self.settings[0]))

    def followed_by(self, other: SceneChange) -> SceneChange:
        """Return this change and the following one combined."""
        return SceneChange(
            _combined(self.entries, other.entries),
            _combined(self.scripts, other.scripts),
            (self.settings[0], other.settings[1]),
        )


def change_between(before: SceneContent, after: SceneContent) -> SceneChange:
    """Return the differences between two contents."""
    return SceneChange(
        _differences(before.entries, after.entries),
        _differences(before.scripts, after.scripts),
        (before.settings, after.settings),
    )


_Key = TypeVar("_Key")


def _differences(before: Mapping[_Key, _Value], after: Mapping[_Key, _Value]) -> dict[_Key, _Pair[_Value]]:
    pairs = ((key, (before.get(key), after.get(key))) for key in {**before, **after})
    return {key: pair for key, pair in pairs if pair[0] is not pair[1] and pair[0] != pair[1]}


def _swapped(pairs: Mapping[_Key, _Pair[_Value]]) -> dict[_Key, _Pair[_Value]]:
    return {key: (after, before) for key, (before, after) in pairs.items()}


def _combined(first: Mapping[_Key, _Pair[_Value]], second: Mapping[_Key, _Pair[_Value]]) -> dict[_Key, _Pair[_Value]]:
    pairs = {
        key: (first.get(key, second.get(key, (None, None)))[0], second.get(key, first.get(key, (None, None)))[1])
        for key in {**first, **second}
    }
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def apply_change(simulation: Simulation, change: SceneChange, apply_settings: Callable[[Settings], None]) -> None:
    """Apply a change to a scene that is in the state before it; `apply_settings` applies changed settings.

    Raises ValueError; a part of the change may then be applied already.
    """
    _ChangeApplier(simulation, change).apply_change(apply_settings)


class _ChangeApplier:
    def __init__(self, simulation: Simulation, change: SceneChange):
        self._simulation = simulation
        self._change = change
        pairs = change.entries.items()
        self._removed = [handle for handle, (_, after) in pairs if after is None]
        self._added = {handle: after for handle, (before, after) in pairs if before is None and after is not None}
        self._changed = {handle: (old, new) for handle, (old, new) in pairs if old is not None and new is not None}

    def apply_change(self, apply_settings: Callable[[Settings], None]) -> None:
        self._remove()
        before, after = self._change.settings
        if before != after:
            apply_settings(after)
        self._rename({handle: new.name for handle, (old, new) in self._changed.items() if old.name != new.name})
        if self._added:
            self._simulation.context.objects.reserve({new.name: handle for handle, new in self._added.items()})
            self._simulation.operations.add([*self._added.values()])
            self._simulation.scene.put_in_order()
        self._replace_entries()
        self._set_places()
        for name, (_, script) in self._change.scripts.items():
            if script is not None and self._simulation.scene.scripts.get(name) != script:
                self._simulation.operations.attach_script(script)

    def _remove(self) -> None:
        operations = self._simulation.operations
        for name, (_, script) in self._change.scripts.items():
            if script is None:
                operations.detach_script(name)
        if self._removed:
            operations.remove(self._removed)

    def _rename(self, names: dict[int, str]) -> None:
        """Rename objects, even if some exchange their names."""
        tree, operations = self._simulation.context.objects, self._simulation.operations
        while names:
            free = [handle for handle, name in names.items() if name not in tree]
            if not free:
                first = next(iter(names))
                operations.rename(first, operations.free_name(names[first]))
            for handle in free:
                operations.rename(handle, names.pop(handle))

    def _replace_entries(self) -> None:
        """Set the new entries, all at once, so that the world is rebuilt only once."""
        operations, entries = self._simulation.operations, {}
        for handle, (old, new) in self._changed.items():
            if type(old) is not type(new):
                self._replace(handle, new)
        for handle, (old, new) in self._changed.items():
            if type(old) is type(new) and _different_keys(old, new) - {"name", *_DESCRIPTION_KEYS, *_POSE_KEYS}:
                now = operations.entry(handle)
                entries[handle] = new.model_copy(update={"name": now.name, "parent": now.parent})
        if entries:
            operations.replace_entries(entries)
        for handle, (old, new) in self._changed.items():
            described = {key: getattr(new, key) for key in _DESCRIPTION_KEYS if key in _different_keys(old, new)}
            if described and type(old) is type(new):
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

    def _set_places(self) -> None:
        tree, operations = self._simulation.context.objects, self._simulation.operations
        reparented = {handle: new for handle, (old, new) in self._changed.items() if old.parent != new.parent}
        for handle in reparented:  # to the world first: two objects may exchange their places
            operations.set_parent(handle, WORLD, keep_in_place=True)
        for handle, new in reparented.items():
            if new.parent:
                operations.set_parent(handle, tree.handle(new.parent), keep_in_place=True)
        moved = [
            (handle, new)
            for handle, (old, new) in self._changed.items()
            if any(getattr(old, key) != getattr(new, key) for key in _POSE_KEYS)
        ]
        for handle, new in sorted(moved, key=lambda item: levels(tree[item[0]])):
            operations.put(handle, new.local)


def _different_keys(old: EntryParameters, new: EntryParameters) -> set[str]:
    return {key for key in type(new).model_fields if getattr(old, key, None) != getattr(new, key)}
