"""Operations on the objects of a scene, for scripts and windows, while the simulation runs and while it is stopped."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.object_names import first_free, numbered, plain, shifted, suffixes
from drone_sim.mechanics.object_tree import PARENT, WORLD, levels
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene import geometry, models
from drone_sim.scene.entry import EntryParameters, KindParameters, Place, placed
from drone_sim.scene.kinds.dummy import DummyParameters, check_links
from drone_sim.scene.kinds.joints import ForceSensor, ForceSensorParameters, JointParameters
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters
from drone_sim.scene.scene import ObjectRecord, Scene
from drone_sim.scene.scene_parameters import (
    MAX_OBJECTS,
    MAX_SCRIPTS,
    AttachedScriptParameters,
    check_files,
    check_parents,
    entry_from,
)

_Scripts = Sequence[AttachedScriptParameters]
_IN_DYNAMICS = (ObjectParameters, JointParameters, ForceSensorParameters)


class RunningScripts(Protocol):
    """Interface to the scripts of the scene's objects, called when objects are added, renamed or removed."""

    def attach(self, objects: Collection[str]) -> object:
        """Attach the scripts of added objects; each is initialised before its first call."""

    def rename(self, name: str, new: str) -> None:
        """Move the script of a renamed object, if it has one, to the object's new name."""

    def end(self, objects: Collection[str]) -> None:
        """Call cleanup and detach the scripts of objects to be removed; a script that is running ends later."""


class SceneOperations:
    """Operations on objects, which are identified by their handles; values are named as in a scene file.

    Operations are atomic: if one is not possible, it raises ValueError with a message of one line, and nothing changes.
    """

    def __init__(self, scene: Scene, folder: Path | None, scripts: RunningScripts, imported: Callable[[Path], Path]):
        """Create them; models are read from and written to `folder`.

        `imported` converts a V-REP file to a scene file and returns it; it raises ValueError and OSError.
        """
        self.folder, self.imported = folder, imported
        self._scene, self._scripts = scene, scripts

    # ---- entries and handles

    def entry(self, handle: int) -> EntryParameters:
        """Return an object's entry with its present values. Raises ValueError if the object is not of the scene."""
        return self._record(handle).present

    def model(self, handle: int) -> list[int]:
        """Return an object and its descendants, parents first. Raises ValueError for an unknown handle."""
        tree = self._scene.tree
        return [handle, *(descendant for child, _ in tree.children(tree[handle]) for descendant in self.model(child))]

    def free_name(self, wanted: str) -> str:
        """Return an unused name: the wanted one, or the first free one with a number: Cuboid, Cuboid0, Cuboid1, ..."""
        return first_free(numbered(plain(wanted)), self._scene.tree)

    def _record(self, handle: int) -> ObjectRecord:
        item = self._scene.tree[handle]
        record = self._record_of(item)
        if record is not None:
            return record
        what = "the floor" if item.name == "Floor" else "a part of a vehicle"
        raise ValueError(f"'{item.name}' is {what}: only objects of the scene can be changed")

    def _record_of(self, item: SceneObject) -> ObjectRecord | None:
        return next((record for record in self._scene.records.values() if record.item is item), None)

    # ---- adding and removing

    def add(self, items: Sequence[Mapping[str, Any] | EntryParameters], scripts: _Scripts = ()) -> list[int]:
        """Add entries as in a scene file, and scripts on them; return the handles of the new objects."""
        scene, tree = self._scene, self._scene.tree
        entries = [item if isinstance(item, EntryParameters) else entry_from(item) for item in items]
        if len(scene.records) + len(entries) > MAX_OBJECTS:
            raise ParameterError(f"a scene has at most {MAX_OBJECTS} objects, not {len(scene.records) + len(entries)}")
        if len(scene.scripts) + len(scripts) > MAX_SCRIPTS:
            raise ParameterError(f"a scene has at most {MAX_SCRIPTS} scripts, not {len(scene.scripts) + len(scripts)}")
        names: set[str] = set()
        parents = {entry.name for entry in entries}
        for entry in entries:
            if not entry.name or entry.name in tree or entry.name in names:
                why = f"an object named '{entry.name}' already exists" if entry.name else "an object needs a `name`"
                raise ParameterError(why)
            if entry.parent and entry.parent not in tree and entry.parent not in parents:
                raise ParameterError(f"no object is named '{entry.parent}', the parent of '{entry.name}'")
            names.add(entry.name)
        check_parents(entries)
        shapes = [entry for entry in entries if isinstance(entry, ObjectParameters)]
        if shapes:
            check_files(scene.parameters.floor, [*scene.entries.values(), *shapes])
        with self._changing(any(isinstance(entry, _IN_DYNAMICS) for entry in entries)):
            first = scene.next_index
            scene.next_index += len(entries)
            scene.records.update((index, ObjectRecord(entry)) for index, entry in enumerate(entries, first))
            scene.scripts.update({script.object: script for script in scripts})
            self._check_links(entries)
        if scripts:
            self._scripts.attach([script.object for script in scripts])
        return [tree.handle(entry.name) for entry in entries]

    def remove(self, handles: Collection[int]) -> None:
        """Remove objects with their scripts; their children stay where they are."""
        scene = self._scene
        names = [self._record(handle).entry.name for handle in handles]
        self._scripts.end([name for name in names if name in scene.scripts])
        present = {*scene.tree}  # a cleanup may have removed some
        removed = {self._record(handle): int(handle) for handle in handles if handle in present}
        parents = {id(record.item) for record in removed}
        freed = [(it, it.matrix()) for it in map(scene.tree.__getitem__, scene.tree) if id(it.parent) in parents]

        def take_out() -> None:
            for item, matrix in freed:
                item.parent = None
                if item.body is None:
                    item.local = matrix
            scene.tree.remove(set(removed.values()))

        with self._changing(change_tree=take_out):
            for item, matrix in freed:
                record = self._record_of(item)
                if record is not None and record not in removed:
                    record.entry = placed(record.entry, "", matrix)
                    self._mark_for_rebuild(item)
            scene.records = {key: record for key, record in scene.records.items() if record not in removed}
            for record in removed:
                scene.scripts.pop(record.entry.name, None)
            self._end_links({record.entry.name for record in removed})

    def copy(self, handles: Sequence[int]) -> list[int]:
        """Add copies of objects, which may be children of each other, and of their scripts; return the new handles."""
        entries = [self.entry(handle) for handle in handles]
        names = {entry.name for entry in entries}
        matrices = map(self._scene.tree.matrix, handles)
        copies = [entry if entry.parent in names else placed(entry, "", at) for entry, at in zip(entries, matrices)]
        return self.add_named_anew(copies, [script for name, script in self._scene.scripts.items() if name in names])

    def add_named_anew(self, entries: Sequence[EntryParameters], scripts: _Scripts = ()) -> list[int]:
        """Add entries and their scripts under their names or, if one is taken, all of them with names of copies."""
        tree, renames = self._scene.tree, {"": ""}
        names: list[str] = []
        for entry, wanted in zip(entries, shifted([entry.name for entry in entries], {*tree.names})):
            copies = (plain(wanted) + suffix for suffix in suffixes() if suffix)
            names.append(first_free(itertools.chain([wanted], copies), tree, names))
            renames.setdefault(entry.name, names[-1])
        renamed = []
        for entry, name in zip(entries, names):
            alias, parent = "" if entry.shown == name else entry.shown, renames.get(entry.parent, entry.parent)
            values = {"name": name, "alias": alias, "parent": parent}
            if isinstance(entry, DummyParameters):
                values["linked"] = renames.get(entry.linked, "")
            renamed.append(entry.model_copy(update=values))
        new_scripts = [it.model_copy(update={"object": renames[it.object]}) for it in scripts if renames.get(it.object)]
        return self.add(renamed, new_scripts)

    def add_mesh(self, name: str, vertices: Sequence[float], indices: Sequence[int]) -> int:
        """Add a static mesh, given by vertices (m) and triangle indices; return its handle."""
        entries = [*self._scene.entries.values(), *self._scene.parameters.objects]
        used = {file for entry in entries if isinstance(file := getattr(entry, "file", None), str)}
        file = models.mesh_file(vertices, indices, used)
        keys = {"name": name, "alias": name, "shape": "mesh", "file": file, "color": [0.7, 0.7, 0.7]}
        return self.add([{**keys, "mass": 1.0, "static": True, "respondable": False}])[0]

    def group(self, handles: Sequence[int]) -> int:
        """Merge shapes into one compound with name and frame of the first; return its handle."""
        if len({*handles}) != len(handles) or len(handles) < 2:
            raise ValueError("must be at least two different shapes")
        entries = [self.entry(member) for member in handles]
        compound = geometry.grouped(entries, [self._scene.tree.matrix(member) for member in handles])
        (handle,) = self.add([{**compound, "name": self.free_name(entries[0].name)}])
        self._move_script(entries[0].name, self._scene.tree[handle].name)
        self._replace_by(handles, handle)
        self.rename(handle, entries[0].name)
        return handle

    def ungroup(self, handle: int) -> list[int]:
        """Split a compound into one shape for each part; return their handles."""
        entry = self.entry(handle)
        parts = geometry.parted(entry, self._scene.tree.matrix(handle))
        new = self.add_named_anew([entry_from({**part, "name": entry.name}) for part in parts])
        self._move_script(entry.name, self._scene.tree[new[0]].name)
        self._replace_by([handle], new[0])
        return new

    def _replace_by(self, handles: Sequence[int], new_parent: int) -> None:
        """Remove objects after moving their children to `new_parent`."""
        tree = self._scene.tree
        for handle in handles:
            for child, _ in [*tree.children(tree[handle])]:
                if child not in handles:
                    self.set_parent(child, new_parent, keep_in_place=True)
        self.remove(handles)

    def load_model(self, name: str) -> int:
        """Add the objects and scripts of a model, also of a V-REP model (.ttm); return the first object's handle."""
        return self.add_named_anew(*models.read(models.inside(self.folder, name, ".ttm"), self.imported).checked())[0]

    def save_model(self, handle: int, name: str) -> None:
        """Write an object and its descendants to a file in the folder of the scene."""
        self.write_model(self.model(handle), models.inside(self.folder, name))

    def write_model(self, members: Sequence[int], path: Path) -> None:
        """Write objects with their scripts to a file, the base first."""
        entries = [self.entry(member) for member in members]
        names = {entry.name for entry in entries}
        for index, entry in enumerate(entries):
            if isinstance(entry, DummyParameters) and entry.linked not in names:
                entries[index] = entry.model_copy(update={"linked": ""})
        scripts = [self._scene.scripts[entry.name] for entry in entries if entry.name in self._scene.scripts]
        models.write(path, [placed(entries[0], "", self._scene.tree.matrix(members[0])), *entries[1:]], scripts)

    # ---- names and parents

    def rename(self, handle: int, name: str) -> None:
        """Rename an object; the name must be unused."""
        scene, record = self._scene, self._record(handle)
        before = record.entry
        if name in scene.tree and scene.tree.handle(name) != handle:
            raise ParameterError(f"an object named '{name}' already exists")
        if not name:
            raise ParameterError("name = '': must have at least 1 character")
        renamed = changed(before, {"name": name})
        with self._changing(change_tree=lambda: scene.tree.rename(int(handle), name)):
            record.entry = record.entry.model_copy(update={"name": renamed.name})
            for other in scene.records.values():
                for key in ("parent", "linked"):
                    if before.name and getattr(other.entry, key, "") == before.name:
                        other.entry = other.entry.model_copy(update={key: name})
        self._move_script(before.name, name)
        if not before.alias:
            scene.tree[handle].alias = name

    def _move_script(self, name: str, new_name: str) -> None:
        """Move the script of the object `name`, if it has one, to another object, or to the object's new name."""
        script = self._scene.scripts.pop(name, None)
        if script is not None:
            self._scene.scripts[new_name] = script.model_copy(update={"object": new_name})
            self._scripts.rename(name, new_name)

    def set_alias(self, handle: int, alias: str) -> None:
        self.describe(handle, alias=alias)

    def describe(self, handle: int, **values: Any) -> None:
        """Set `alias`, `category` or `model` (whether it is a model base) of an object."""
        record = self._record(handle)
        checked = changed(record.entry, values)
        record.entry = record.entry.model_copy(update={key: getattr(checked, key) for key in values})
        self._scene.is_changed = True
        described = self._scene.tree[handle]
        described.alias, described.is_model = checked.shown, checked.model

    def link(self, handle: int, other: int) -> None:
        """Link two dummies in place of their present links; -1 for `other` only ends the link."""
        linked = [self._record(one) for one in (handle, other) if one != WORLD]
        for record in linked:
            if not isinstance(record.entry, DummyParameters):
                raise ValueError(f"'{record.entry.name}' is no dummy: only dummies of the scene can be linked")
        if handle == other:
            raise ValueError(f"'{linked[0].entry.name}' cannot be linked to itself")
        names = {record.entry.name for record in linked}
        with self._changing(bodies=False):
            self._end_links(names)
            if other != WORLD:
                linked[0].entry = linked[0].entry.model_copy(update={"linked": linked[1].entry.name})

    def linked(self, handle: int) -> int:
        """Return the handle of the dummy that a dummy is linked to, -1 if it has no link."""
        tree = self._scene.tree
        record = self._record_of(tree[handle])
        if record is None:  # a vehicle's object
            return WORLD
        entry = record.entry
        linking = [one.name for one in self._scene.entries.values() if getattr(one, "linked", "") == entry.name]
        names = [getattr(entry, "linked", ""), *linking]
        return next((tree.handle(name) for name in names if name in tree), WORLD)

    def _end_links(self, names: Collection[str]) -> None:
        for record in self._scene.records.values():
            entry = record.entry
            if isinstance(entry, DummyParameters) and entry.linked and (entry.name in names or entry.linked in names):
                record.entry = entry.model_copy(update={"linked": ""})

    def _check_links(self, changed_entries: Iterable[EntryParameters]) -> None:
        """Raise ParameterError for an impossible link of one of these dummies, which are in the scene already."""
        if any(isinstance(entry, DummyParameters) and entry.linked for entry in changed_entries):
            check_links(self._scene.entries.values())

    # ---- scripts

    def attach_script(self, script: AttachedScriptParameters) -> None:
        """Attach a script to an object, also of a vehicle, in place of its present one."""
        scene = self._scene
        scene.tree.handle(script.object)
        if script.object not in scene.scripts and len(scene.scripts) >= MAX_SCRIPTS:
            raise ParameterError(f"a scene has at most {MAX_SCRIPTS} scripts")
        self.detach_script(script.object)
        scene.scripts[script.object] = script
        scene.is_changed = True
        try:
            self._scripts.attach([script.object])
        except ParameterError:
            del scene.scripts[script.object]
            raise

    def detach_script(self, name: str) -> None:
        """Remove the script of an object, if it has one."""
        if name in self._scene.scripts:
            self._scripts.end([name])
            del self._scene.scripts[name]
            self._scene.is_changed = True

    # ---- poses and parents

    def put(self, handle: int, local: frames.Matrix) -> None:
        """Set an object's pose in its parent's frame, also of an object that a joint holds."""
        scene, record = self._scene, self._record(handle)
        moved = scene.tree[handle]
        if not getattr(moved, "is_held", False) and moved.kind not in ("joint", "force_sensor"):
            scene.tree.set_matrix(handle, PARENT, local)
            scene.is_changed = True
            return

        def put() -> None:
            if moved.body is None:
                moved.local = local

        with self._changing(change_tree=put):
            present = record.present
            record.entry = placed(present, present.parent, local)
            record.version += 1
            self._mark_for_rebuild(moved)

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Set an object's parent (-1: none), as ObjectTree.set_parent does; a new joint parent may hold it.

        Raises ValueError if it cannot be a child of this parent.
        """
        tree = self._scene.tree
        tree.check_parent(handle, parent)
        moved, new_parent = tree[handle], None if parent == WORLD else tree[parent]
        record = self._record_of(moved)
        if record is None:  # a vehicle's object
            tree.set_parent(handle, parent, keep_in_place)
            return
        entry, keeps_pose = self.entry(handle), keep_in_place or moved.body is not None
        local = frames.relative(new_parent.below(), moved.matrix()) if new_parent is not None else moved.matrix()
        local = local if keeps_pose else moved.local

        def hang() -> None:
            moved.parent = new_parent
            if moved.body is None:
                moved.local = local
                moved.put(moved.matrix())
            tree.refresh_free_children()

        with self._changing(change_tree=hang):
            record.entry = placed(entry, new_parent.name if new_parent is not None else "", local)
            self._mark_for_rebuild(moved)

    def _mark_for_rebuild(self, moved: SceneObject) -> None:
        """Mark a re-parented joint or force sensor, and those below a re-parented object, for rebuild."""
        for record in self._scene.records.values():
            item = record.item
            if isinstance(item, (Joint, ForceSensor)) and (item is moved or item.is_descendant_of(moved)):
                record.version += 1

    # ---- properties

    def change(self, handle: int, **values: Any) -> None:
        """Change keys of an object's entry, such as `mass` or `size`."""
        self.replace_entries({handle: self.entry_with(handle, values)})

    def entry_with(self, handle: int, values: dict[str, Any]) -> EntryParameters:
        """Return the entry of an object with some values changed, for `replace_entries`."""
        entry = self.entry(handle)
        if values.get("mass") and isinstance(entry, ObjectParameters) and not entry.mass:
            values.setdefault("static", True)  # as before
        checked = changed(entry, values)
        is_kept = "mass" in values and "inertia" not in values
        if is_kept and isinstance(entry, ObjectParameters) and entry.inertia is not None and entry.mass:
            moments = [moment * values["mass"] / entry.mass for moment in entry.inertia.moments]  # same distribution
            values["inertia"] = {"moments": moments}
            checked = changed(entry, values)
        return entry.model_copy(update={key: getattr(checked, key) for key in values})

    def paint(self, handle: int, rgba: Sequence[float | None]) -> None:
        """Set the color of a shape and all its parts; None keeps a component."""
        entry, record = self.entry(handle), self._record(handle)
        before = self.color(handle)
        painted = [old if new is None else new for old, new in zip(before, rgba)]
        assert isinstance(entry, ObjectParameters), "only a shape has a color"
        color = changed(entry, {"color": painted}).color
        values: dict[str, Any] = {"color": color}
        if isinstance(entry, CompoundParameters):
            values = {"parts": [part.model_copy(update={"color": color}) for part in entry.parts]}
        record.entry = entry.model_copy(update=values)
        self._scene.is_changed = True
        self._scene.paint(record, color)

    def color(self, handle: int) -> tuple[float, ...]:
        """Return the color of a shape, or of a compound's first part. Raises ValueError if it has none."""
        entry = self.entry(handle)
        if not isinstance(entry, ObjectParameters) or entry.shape == "urdf":
            raise ValueError(f"'{entry.name}' has no color of its own")
        return entry.parts[0].color if isinstance(entry, CompoundParameters) else entry.color

    def box(self, handle: int) -> tuple[frames.Vector, frames.Vector]:
        """Return size and centre (m) of a shape's bounding box, in the shape's frame."""
        low, high = geometry.bounds(self.entry(handle))
        (a, b, c), (x, y, z) = map(float, high - low), map(float, (low + high) / 2)
        return (a, b, c), (x, y, z)

    def forms(self, handle: int) -> list[tuple[str, tuple[float, ...]]]:
        """Return an object's shape or a compound's shapes, as (`shape`, `size`); empty if it is not a scene shape."""
        record = self._record_of(self._scene.tree[handle])
        entry = record.entry if record is not None else None
        if isinstance(entry, CompoundParameters):
            return [(part.shape, getattr(part, "size", ())) for part in entry.parts]
        return [(entry.shape, getattr(entry, "size", ()))] if isinstance(entry, ObjectParameters) else []

    def scale(self, handles: Collection[int], factors: Sequence[float], positions: bool = False) -> None:
        """Scale objects and their masses by factors along x, y and z; if `positions`, also their positions."""
        x, y, z = factors
        entries = {handle: geometry.scaled(self.entry(handle), (x, y, z)) for handle in handles}
        tree = self._scene.tree
        places = {}
        if positions:
            for handle in entries:
                m = tree[handle].matrix() if tree[handle].parent is None else tree.matrix(handle, PARENT)
                places[handle] = (*m[:3], x * m[3], *m[4:7], y * m[7], *m[8:11], z * m[11])
        self.replace_entries(entries)
        for handle in sorted(places, key=lambda key: levels(tree[key])):
            if not getattr(tree[handle], "is_held", False):
                tree.set_matrix(handle, PARENT, places[handle])
        for handle in entries:
            record = self._record(handle)
            a, b, c = record.factors
            record.factors = x * a, y * b, z * c

    def factors(self, handle: int) -> tuple[float, float, float]:
        """Return the factors by which an object has been scaled along x, y and z."""
        item = self._scene.tree[handle]
        record = self._record_of(item)
        x, y, z = record.factors if record is not None else (1.0, 1.0, 1.0)
        return x * item.size_factor, y * item.size_factor, z * item.size_factor

    def replace_entries(self, entries: Mapping[int, EntryParameters]) -> None:
        """Replace the entries of objects; names, parents and poses stay the same."""
        scene = self._scene
        records = {handle: self._record(handle) for handle in entries}
        new_entries = entries.values()
        if any(isinstance(entry, ObjectParameters) for entry in new_entries):
            replaced = {*records.values()}
            others = [record.entry for record in scene.records.values() if record not in replaced]
            check_files(scene.parameters.floor, [*others, *new_entries])

        def replace_objects() -> None:
            for handle, record in records.items():
                entry, before = entries[handle], scene.tree[handle]
                if isinstance(entry, KindParameters):
                    place = Place(before.names, before.alias, before.parent, before.local)
                    scene.replace_object(record, int(handle), entry, place)

        with self._changing(any(isinstance(entry, _IN_DYNAMICS) for entry in new_entries), change_tree=replace_objects):
            for handle, record in records.items():
                present = record.present
                place = {key: getattr(present, key) for key in ("position", "rpy", "parent")}
                record.entry = entries[handle].model_copy(update=place)
                record.version += 1
            self._check_links(new_entries)

    # ---- atomic changes

    @contextlib.contextmanager
    def _changing(self, bodies: bool = True, change_tree: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Update world and tree after entries were changed inside `with`; on ValueError, restore the entries."""
        scene = self._scene
        before = {index: (record, record.entry, record.version) for index, record in scene.records.items()}
        number, scripts = scene.next_index, dict(scene.scripts)
        if bodies:
            scene.sync_chains()
        try:
            yield
            scene.rebuild(change_tree, bodies)
        except ValueError:
            scene.records = {index: record for index, (record, _, _) in before.items()}
            for record, entry, version in before.values():
                record.entry, record.version = entry, version
            scene.next_index, scene.scripts = number, scripts
            raise
        scene.is_changed = True
