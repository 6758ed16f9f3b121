"""Changes of a scene by edits, and their history for undo and redo."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

from drone_sim.mechanics.object_tree import WORLD, levels
from drone_sim.run.scene_document import SceneContent, Settings
from drone_sim.run.simulation import Simulation
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

MOST = 100  # steps of undo
_Key = TypeVar("_Key")
_Value = TypeVar("_Value")
_Pair = tuple[_Value | None, _Value | None]  # before and after; None if absent
_Changed = Mapping[int, tuple[EntryParameters, EntryParameters]]
_DESCRIPTION_KEYS = ("alias", "category", "model")
_POSE_KEYS = {"parent", "position", "rpy"}


class SceneChange(NamedTuple):
    """The differences made by an edit: objects by handle, scripts by the name of their object, and settings."""

    entries: dict[int, _Pair[EntryParameters]]
    scripts: dict[str, _Pair[AttachedScriptParameters]]
    settings: tuple[Settings, Settings]

    @property
    def is_empty(self) -> bool:
        return not self.entries and not self.scripts and self.settings[0] == self.settings[1]

    @property
    def reversed(self) -> SceneChange:
        """The change that undoes this one."""
        entries = {handle: (after, before) for handle, (before, after) in self.entries.items()}
        scripts = {name: (after, before) for name, (before, after) in self.scripts.items()}
        return SceneChange(entries, scripts, (self.settings[1], self.settings[0]))

    def followed_by(self, other: SceneChange) -> SceneChange:
        return SceneChange(
            _combined(self.entries, other.entries),
            _combined(self.scripts, other.scripts),
            (self.settings[0], other.settings[1]),
        )


def change_between(before: SceneContent, after: SceneContent) -> SceneChange:
    return SceneChange(
        _differences(before.entries, after.entries),
        _differences(before.scripts, after.scripts),
        (before.settings, after.settings),
    )


def _differences(before: Mapping[_Key, _Value], after: Mapping[_Key, _Value]) -> dict[_Key, _Pair[_Value]]:
    pairs = ((key, (before.get(key), after.get(key))) for key in {**before, **after})
    return {key: pair for key, pair in pairs if pair[0] is not pair[1] and pair[0] != pair[1]}


def _combined(first: Mapping[_Key, _Pair[_Value]], second: Mapping[_Key, _Pair[_Value]]) -> dict[_Key, _Pair[_Value]]:
    pairs = {
        key: (first.get(key, second.get(key, (None, None)))[0], second.get(key, first.get(key, (None, None)))[1])
        for key in {**first, **second}
    }
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def apply_change(simulation: Simulation, change: SceneChange) -> None:
    """Apply a change to a scene that is in the state before it.

    Raises ValueError; a part of the change may then be applied already.
    """
    entries, scripts = change.entries.items(), change.scripts.items()
    removed = [handle for handle, (_, new) in entries if new is None]
    added = {handle: new for handle, (old, new) in entries if old is None and new is not None}
    changed = {handle: (old, new) for handle, (old, new) in entries if old is not None and new is not None}
    for name, (_, script) in scripts:
        if script is None:
            simulation.operations.detach_script(name)
    if removed:
        simulation.operations.remove(removed)
    if change.settings[0] != change.settings[1]:
        simulation.apply_settings(change.settings[1])  # this may replace operations, tree and scene
    _rename(simulation, {handle: new.name for handle, (old, new) in changed.items() if old.name != new.name})
    if added:
        simulation.tree.reserve({new.name: handle for handle, new in added.items()})
        simulation.operations.add([*added.values()])
        simulation.scene.put_in_order()
    _replace_entries(simulation, changed)
    _set_places(simulation, changed)
    for name, (_, script) in scripts:
        if script is not None and simulation.scene.scripts.get(name) != script:
            simulation.operations.attach_script(script)


def _rename(simulation: Simulation, names: dict[int, str]) -> None:
    """Rename objects, even if some exchange their names."""
    tree, operations = simulation.tree, simulation.operations
    while names:
        free = [handle for handle, name in names.items() if name not in tree]
        if not free:
            first = next(iter(names))
            operations.rename(first, operations.free_name(names[first]))
        for handle in free:
            operations.rename(handle, names.pop(handle))


def _replace_entries(simulation: Simulation, changed: _Changed) -> None:
    """Set the new entries, all at once, so that the world is rebuilt only once."""
    operations, tree, entries = simulation.operations, simulation.tree, {}
    for handle, (old, new) in changed.items():
        if type(old) is not type(new):  # replace the object by one of another type, at the same place in the tree
            children = [child for child, _ in tree.children(tree[handle])]
            script = simulation.scene.scripts.get(new.name)
            operations.remove([handle])
            tree.reserve({new.name: handle})
            operations.add([new], [script] if script else [])
            for child in children:
                operations.set_parent(child, handle, keep_in_place=True)
    same_type = {handle: (old, new) for handle, (old, new) in changed.items() if type(old) is type(new)}
    for handle, (old, new) in same_type.items():
        if _different_keys(old, new) - {"name", *_DESCRIPTION_KEYS, *_POSE_KEYS}:
            now = operations.entry(handle)
            entries[handle] = new.model_copy(update={"name": now.name, "parent": now.parent})
    if entries:
        operations.replace_entries(entries)
    for handle, (old, new) in same_type.items():
        described = {key: getattr(new, key) for key in _DESCRIPTION_KEYS if key in _different_keys(old, new)}
        if described:
            operations.describe(handle, **described)


def _set_places(simulation: Simulation, changed: _Changed) -> None:
    tree, operations = simulation.tree, simulation.operations
    reparented = {handle: new for handle, (old, new) in changed.items() if old.parent != new.parent}
    for handle in reparented:  # to the world first: two objects may exchange their places
        operations.set_parent(handle, WORLD, keep_in_place=True)
    for handle, new in reparented.items():
        if new.parent:
            operations.set_parent(handle, tree.handle(new.parent), keep_in_place=True)
    moved = [
        (handle, new) for handle, (old, new) in changed.items() if not _POSE_KEYS.isdisjoint(_different_keys(old, new))
    ]
    for handle, new in sorted(moved, key=lambda item: levels(tree[item[0]])):
        operations.put(handle, new.local)


def _different_keys(old: EntryParameters, new: EntryParameters) -> set[str]:
    return {key for key in type(new).model_fields if getattr(old, key, None) != getattr(new, key)}


# ---- history


class Step(NamedTuple):
    """One step of undo: its name, the `merge` key that its edits share, and the change."""

    name: str
    merge: str
    change: SceneChange


class History:
    """The steps that can be undone and redone."""

    def __init__(self) -> None:
        self._done: list[Step] = []
        self._undone: list[Step] = []
        self._at_start: tuple[list[Step], list[Step]] | None = None  # both lists at the start of the simulation

    @property
    def undo_name(self) -> str:
        """The name of the next step to undo, '' if there is none."""
        return self._done[-1].name if self._done else ""

    @property
    def redo_name(self) -> str:
        """The name of the next step to redo, '' if there is none."""
        return self._undone[-1].name if self._undone else ""

    def is_last(self, merge: str) -> bool:
        return bool(self._done) and self._done[-1].merge == merge

    def of(self, merge: str) -> Step:
        """Return the newest step with this `merge` key. Raises ValueError if there is none."""
        for step in reversed(self._done):
            if step.merge == merge:
                return step
        raise ValueError("there is nothing to undo")

    def add(self, step: Step) -> None:
        """Add a step and clear the steps to redo; steps with the same `merge` key in a row become one."""
        self._undone.clear()
        last = self._done[-1] if self._done else None
        if last is not None and step.merge and last.merge == step.merge:
            self._done[-1] = last._replace(change=last.change.followed_by(step.change))
            if self._done[-1].change.is_empty:
                self._done.pop()
            return
        self._done = [*self._done, step][-MOST:]

    def undone(self) -> Step:
        """Return the step to undo, and move it to those to redo. Raises ValueError if there is none."""
        if not self._done:
            raise ValueError("there is nothing to undo")
        self._undone.append(self._done.pop())
        return self._undone[-1]

    def redone(self) -> Step:
        """Return the step to redo, and move it to those to undo. Raises ValueError if there is none."""
        if not self._undone:
            raise ValueError("there is nothing to redo")
        self._done.append(self._undone.pop()._replace(merge=""))
        return self._done[-1]

    def clear(self) -> None:
        self._done, self._undone, self._at_start = [], [], None

    def start(self) -> None:
        """Begin a run: stop() drops the steps made after this."""
        self._at_start = [*self._done], [*self._undone]

    def stop(self) -> None:
        """End a run: restore the history to that at the start."""
        if self._at_start is not None:
            self._done, self._undone = self._at_start
            self._at_start = None
