"""What may be done to the objects of a scene, while it runs and while it is stopped: one set of operations for all.

Each is done as a whole or, where a line says why not, not at all. What is done is told in the words of a scene file.
"""

from __future__ import annotations

import contextlib
import itertools
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames
from drone_sim.mechanics.object_names import numbered, plain, shifted, suffixed
from drone_sim.mechanics.object_tree import PARENT, WORLD, levels
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene import models
from drone_sim.scene.attached_scripts import MAX_SCRIPTS, AttachedScriptParameters, RunningScripts
from drone_sim.scene.entry import EntryParameters, Place, placed
from drone_sim.scene.kinds.force_sensor import ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.kinds.kind import KindParameters
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters
from drone_sim.scene.scaling import scaled
from drone_sim.scene.scene import Scene
from drone_sim.scene.scene_parameters import (
    MAX_OBJECTS,
    check_files,
    check_parents,
    entry_from,
    name_shapes,
    script_from,
)

_IN_DYNAMICS = (ObjectParameters, JointParameters, ForceSensorParameters)


class SceneOperations:
    """Adds, removes, renames, reparents, copies, recolours, resizes; objects are given and told by their handles."""

    def __init__(self, scene: Scene, folder: Path | None, scripts: RunningScripts, imported: Callable[[Path], Path]):
        """Take the scene, where models are read and written, and what runs the scripts of objects.

        `imported` returns the scene file that one of V-REP's is made into; it raises ValueError and OSError.
        """
        self.folder = folder
        self._scene = scene
        self.imported = imported
        self._scripts = scripts

    # ---- which there are

    def entry(self, handle: int) -> EntryParameters:
        """Return what a scene file would say of an object now. Raises ValueError for one that is not the scene's."""
        index = self._index(handle)
        self._scene.write_down((index,))
        return self._scene.entries[index]

    def model(self, handle: int) -> list[int]:
        """Return an object and all that hangs on it, parents first. Raises ValueError for a handle of none."""
        tree = self._scene.tree
        return [handle, *(below for child, _ in tree.children(tree[handle]) for below in self.model(child))]

    def free_name(self, wanted: str) -> str:
        """Return a name that nothing has: the wanted one, or that with a number: Cuboid, Cuboid0, Cuboid1, ..."""
        return next(name for name in numbered(wanted) if name not in self._scene.tree and plain(name) == name)

    def _index(self, handle: int) -> int:
        sought = self._scene.tree[handle]
        index = self._index_of(sought)
        if index is not None:
            return index
        what = "the floor" if sought.name == "Floor" else "a part of a vehicle"
        raise ValueError(f"'{sought.name}' is {what}: only objects of the scene can be changed")

    def _index_of(self, sought: SceneObject) -> int | None:
        return next((index for index, one in self._scene.objects.items() if one is sought), None)

    # ---- come and go

    def add(
        self,
        said: Sequence[Mapping[str, Any] | EntryParameters],
        scripts: Sequence[AttachedScriptParameters] = (),
    ) -> list[int]:
        """Add entries as in a scene file, a model of them perhaps, with scripts on some; return their handles.

        Raises ParameterError.
        """
        scene, tree = self._scene, self._scene.tree
        entries = [one if isinstance(one, EntryParameters) else entry_from(one) for one in said]
        if len(scene.entries) + len(entries) > MAX_OBJECTS:
            raise ParameterError(f"a scene has at most {MAX_OBJECTS} objects, not {len(scene.entries) + len(entries)}")
        if len(scene.scripts) + len(scripts) > MAX_SCRIPTS:
            raise ParameterError(f"a scene has at most {MAX_SCRIPTS} scripts, not {len(scene.scripts) + len(scripts)}")
        names: set[str] = set()
        for one in entries:
            if not one.name or one.name in tree or one.name in names:
                why = f"an object named '{one.name}' already exists" if one.name else "an object needs a `name`"
                raise ParameterError(why)
            if one.parent and one.parent not in tree and one.parent not in {other.name for other in entries}:
                raise ParameterError(f"no object is named '{one.parent}', the parent of '{one.name}'")
            names.add(one.name)
        check_parents(entries)
        shapes = [one for one in entries if isinstance(one, ObjectParameters)]
        if shapes:
            check_files(scene.parameters.floor, [*scene.entries.values(), *shapes])
        with self._changing(any(isinstance(one, _IN_DYNAMICS) for one in entries)):
            first = scene.next_index
            scene.next_index += len(entries)
            scene.entries.update(enumerate(entries, first))
            scene.scripts.update({one.object: one for one in scripts})
        if scripts:
            self._scripts.attach([one.object for one in scripts])
        return [tree.handle(one.name) for one in entries]

    def remove(self, handles: Collection[int]) -> None:
        """Remove objects with their scripts; what hangs on them stays where it is. Raises ValueError."""
        scene = self._scene
        names = [scene.entries[self._index(one)].name for one in handles]
        self._scripts.end([one for one in names if one in scene.scripts])
        there = {*scene.tree}  # a cleanup may have removed some
        gone = {self._index(one): int(one) for one in handles if one in there}
        going = {id(scene.objects[index]) for index in gone}
        orphans = [(one, one.matrix()) for one in map(scene.tree.__getitem__, scene.tree) if id(one.parent) in going]

        def take_out() -> None:
            for one, matrix in orphans:
                one.parent = None
                if one.body is None:
                    one.local = matrix
            scene.tree.remove(set(gone.values()))

        with self._changing(change_tree=take_out):
            for one, matrix in orphans:
                index = self._index_of(one)
                if index is not None and index not in gone:
                    scene.entries[index] = placed(scene.entries[index], "", matrix)
                    self._hold_anew(one)
            for index in gone:
                scene.scripts.pop(scene.entries.pop(index).name, None)

    def copy(self, handles: Sequence[int]) -> list[int]:
        """Add copies of objects, one of which may hang on another, and of their scripts; return their handles.

        Raises ValueError.
        """
        entries = [self.entry(one) for one in handles]
        names = {one.name for one in entries}
        matrices = map(self._scene.tree.matrix, handles)
        copies = [one if one.parent in names else placed(one, "", at) for one, at in zip(entries, matrices)]
        return self.add_named_anew(copies, [one for name, one in self._scene.scripts.items() if name in names])

    def add_named_anew(
        self, entries: Sequence[EntryParameters], scripts: Sequence[AttachedScriptParameters] = ()
    ) -> list[int]:
        """Add entries, and scripts on them, under their names, or, where one is taken, all of them as copies."""
        tree, new, names = self._scene.tree, {"": ""}, []
        for one, wanted in zip(entries, shifted([one.name for one in entries], {*tree.names})):
            free = itertools.chain([wanted], (suffixed(plain(wanted), number) for number in itertools.count()))
            names.append(next(name for name in free if name not in tree and name not in names))
            new.setdefault(one.name, names[-1])
        made = [
            one.model_copy(update={"name": name, "alias": alias, "parent": new.get(one.parent, one.parent)})
            for one, name in zip(entries, names)
            for alias in ["" if one.shown == name else one.shown]
        ]
        on = [one.model_copy(update={"object": new[one.object]}) for one in scripts if new.get(one.object)]
        return self.add(made, on)

    def add_mesh(self, name: str, vertices: Sequence[float], indices: Sequence[int]) -> int:
        """Add a static shape of triangles: their corners' coordinates (m), and those of each. Raises ValueError."""
        entries = [*self._scene.entries.values(), *self._scene.parameters.objects]
        used = {file for one in entries if isinstance(file := getattr(one, "file", None), str)}
        file = models.mesh_file(vertices, indices, used)
        said = {"name": name, "alias": name, "shape": "mesh", "file": file, "color": [0.7, 0.7, 0.7]}
        return self.add([{**said, "mass": 1.0, "static": True, "respondable": False}])[0]

    def group(self, handles: Sequence[int]) -> int:
        """Make one rigid shape of several, with name and frame of the first; return its handle. Raises ValueError."""
        if len({*handles}) != len(handles) or len(handles) < 2:
            raise ValueError("must be at least two different shapes")
        entries = [self.entry(one) for one in handles]
        made = models.grouped(entries, [self._scene.tree.matrix(one) for one in handles])
        (handle,) = self.add([{**made, "name": self.free_name(entries[0].name)}])
        self._move_script(entries[0].name, self._scene.tree[handle].name)
        self._inherit(handles, handle)
        self.rename(handle, entries[0].name)
        return handle

    def ungroup(self, handle: int) -> list[int]:
        """Make a shape of each part of a compound; return their handles. Raises ValueError."""
        entry = self.entry(handle)
        parts = models.parted(entry, self._scene.tree.matrix(handle))
        made = self.add_named_anew([entry_from({**one, "name": entry.name}) for one in parts])
        self._move_script(entry.name, self._scene.tree[made[0]].name)
        self._inherit([handle], made[0])
        return made

    def _inherit(self, handles: Sequence[int], heir: int) -> None:
        """Remove objects; what hangs on them hangs on another from then on."""
        tree = self._scene.tree
        for one in handles:
            for child, _ in [*tree.children(tree[one])]:
                if child not in handles:
                    self.set_parent(child, heir, keep_in_place=True)
        self.remove(handles)

    def load_model(self, name: str) -> int:
        """Add the objects of a file, of V-REP's (.ttm), too, with the scripts on them; return the first one's handle.

        Raises ValueError.
        """
        model = models.read(models.inside(self.folder, name, ".ttm"), self.imported)
        scripts = [script_from(one) for one in model.scripts]
        entries = [entry_from(one) for one in model.objects]
        name_shapes(entries)
        return self.add_named_anew(entries, scripts)[0]

    def save_model(self, handle: int, name: str) -> None:
        """Write an object and all that hangs on it into a file. Raises ValueError."""
        path = models.inside(self.folder, name)
        entries = [self.entry(one) for one in self.model(handle)]
        scripts = [self._scene.scripts[one.name] for one in entries if one.name in self._scene.scripts]
        models.write(path, [placed(entries[0], "", self._scene.tree.matrix(handle)), *entries[1:]], scripts)

    # ---- names and parents

    def rename(self, handle: int, name: str) -> None:
        """Give an object another name, which nothing else has. Raises ValueError."""
        scene, index = self._scene, self._index(handle)
        before = scene.entries[index]
        if name in scene.tree and scene.tree.handle(name) != handle:
            raise ParameterError(f"an object named '{name}' already exists")
        if not name:
            raise ParameterError("name = '': must have at least 1 character")
        renamed = changed(before, {"name": name})
        with self._changing(change_tree=lambda: scene.tree.rename(int(handle), name)):
            scene.entries[index] = before.model_copy(update={"name": renamed.name})
            for other, one in scene.entries.items():
                if one.parent == before.name:
                    scene.entries[other] = one.model_copy(update={"parent": name})
        self._move_script(before.name, name)
        if not before.alias:
            scene.objects[index].alias = name

    def _move_script(self, name: str, heir: str) -> None:
        """Move the script of an object, if it has one, to another object, or to the object's new name."""
        script = self._scene.scripts.pop(name, None)
        if script is not None:
            self._scene.scripts[heir] = script.model_copy(update={"object": heir})
            self._scripts.rename(name, heir)

    def set_alias(self, handle: int, alias: str) -> None:
        """Give an object another alias, which its siblings may have, too. Raises ValueError."""
        self.describe(handle, alias=alias)

    def describe(self, handle: int, **values: Any) -> None:
        """Give an object another `alias` or `category`, or let it be the base of a `model`. Raises ValueError."""
        index = self._index(handle)
        entry = self._scene.entries[index]
        checked = changed(entry, values)
        self._scene.entries[index] = entry.model_copy(update={key: getattr(checked, key) for key in values})
        self._scene.is_changed = True
        described = self._scene.objects[index]
        described.alias, described.is_model = checked.shown, checked.model

    # ---- scripts on them

    def attach_script(self, script: AttachedScriptParameters) -> None:
        """Attach a script to an object, of a vehicle, too, in the place of the one that it has. Raises ValueError."""
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
        """Let an object have no script."""
        if name in self._scene.scripts:
            self._scripts.end([name])
            del self._scene.scripts[name]
            self._scene.is_changed = True

    # ---- where they are

    def put(self, handle: int, local: frames.Matrix) -> None:
        """Put an object somewhere in the frame of its parent, one that a joint holds, too. Raises ValueError."""
        scene, index = self._scene, self._index(handle)
        moved = scene.tree[handle]
        if not getattr(moved, "is_held", False) and moved.kind not in ("joint", "force_sensor"):
            scene.tree.set_matrix(handle, PARENT, local)
            scene.is_changed = True
            return

        def put() -> None:
            if moved.body is None:
                moved.local = local

        with self._changing(change_tree=put):
            scene.entries[index] = placed(self.entry(handle), scene.entries[index].parent, local)
            scene.changed[index] += 1
            self._hold_anew(moved)

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Hang an object on another (-1: on nothing), as ObjectTree.set_parent does; a joint may hold it from now on.

        Raises ValueError where it cannot hang there.
        """
        scene, tree = self._scene, self._scene.tree
        tree.check_parent(handle, parent)
        moved, above = tree[handle], None if parent == WORLD else tree[parent]
        index = self._index_of(moved)
        if index is None:  # of a vehicle
            tree.set_parent(handle, parent, keep_in_place)
            return
        entry, stays = self.entry(handle), keep_in_place or moved.body is not None
        local = frames.relative(above.below(), moved.matrix()) if above is not None else moved.matrix()
        local = local if stays else moved.local

        def hang() -> None:
            moved.parent = above
            if moved.body is None:
                moved.local = local
                moved.put(moved.matrix())
            tree.look_for_loose_ones()

        with self._changing(change_tree=hang):
            scene.entries[index] = placed(entry, above.name if above is not None else "", local)
            self._hold_anew(moved)

    def _hold_anew(self, moved: SceneObject) -> None:
        """Mark the joints and force sensors that got another parent, or hang on such an object, to be built anew."""
        for index, one in self._scene.objects.items():
            if one.kind in ("joint", "force_sensor") and (one is moved or one.hangs_on(moved)):
                self._scene.changed[index] += 1

    # ---- what they are like

    def change(self, handle: int, **values: Any) -> None:
        """Let an entry say something else, such as another `mass` or `size`. Raises ParameterError."""
        self.exchange({handle: self.entry_with(handle, values)})

    def entry_with(self, handle: int, values: dict[str, Any]) -> EntryParameters:
        """Return the entry of an object with other values, for `exchange`. Raises ParameterError."""
        entry = self.entry(handle)
        if values.get("mass") and isinstance(entry, ObjectParameters) and not entry.mass:
            values.setdefault("static", True)  # as it was
        checked = changed(entry, values)
        is_kept = "mass" in values and "inertia" not in values
        if is_kept and isinstance(entry, ObjectParameters) and entry.inertia is not None and entry.mass:
            moments = [one * values["mass"] / entry.mass for one in entry.inertia.moments]  # how it lies stays
            values["inertia"] = {"moments": moments}
            checked = changed(entry, values)
        return entry.model_copy(update={key: getattr(checked, key) for key in values})

    def paint(self, handle: int, rgba: Sequence[float | None]) -> None:
        """Give a shape another color, all its parts; None among the numbers stays. Raises ValueError."""
        entry, index = self.entry(handle), self._index(handle)
        before = self.color(handle)
        painted = [old if new is None else new for old, new in zip(before, rgba)]
        assert isinstance(entry, ObjectParameters), "only a shape has a color"
        color = changed(entry, {"color": painted}).color
        values: dict[str, Any] = {"color": color}
        if isinstance(entry, CompoundParameters):
            values = {"parts": [part.model_copy(update={"color": color}) for part in entry.parts]}
        self._scene.entries[index] = entry.model_copy(update=values)
        self._scene.is_changed = True
        self._scene.paint(index, color)

    def color(self, handle: int) -> tuple[float, ...]:
        """Return the color of a shape, of its first part. Raises ValueError for what has none."""
        entry = self.entry(handle)
        if not isinstance(entry, ObjectParameters) or entry.shape == "urdf":
            raise ValueError(f"'{entry.name}' has no color of its own")
        return entry.parts[0].color if isinstance(entry, CompoundParameters) else entry.color

    def box(self, handle: int) -> tuple[frames.Vector, frames.Vector]:
        """Return size and centre (m) of the box around a shape, along its own axes. Raises ValueError."""
        low, high = models.bounds(self.entry(handle))
        (a, b, c), (x, y, z) = map(float, high - low), map(float, (low + high) / 2)
        return (a, b, c), (x, y, z)

    def forms(self, handle: int) -> list[tuple[str, tuple[float, ...]]]:
        """Return of which forms an object is, each with its size, as a scene file says; none for no shape of it."""
        index = self._index_of(self._scene.tree[handle])
        entry = None if index is None else self._scene.entries[index]
        if isinstance(entry, CompoundParameters):
            return [(one.shape, getattr(one, "size", ())) for one in entry.parts]
        return [(entry.shape, getattr(entry, "size", ()))] if isinstance(entry, ObjectParameters) else []

    def scale(self, handles: Collection[int], factors: Sequence[float], positions: bool = False) -> None:
        """Let objects be so many times as large along x, y and z, and as heavy; `positions`: and as far from parents.

        Raises ValueError, before any of them is changed, for an object that cannot be scaled so.
        """
        x, y, z = factors
        entries = {one: scaled(self.entry(one), (x, y, z)) for one in handles}
        tree = self._scene.tree
        places = {}
        if positions:
            for handle in entries:
                m = tree[handle].matrix() if tree[handle].parent is None else tree.matrix(handle, PARENT)
                places[handle] = (*m[:3], x * m[3], *m[4:7], y * m[7], *m[8:11], z * m[11])
        self.exchange(entries)
        for handle in sorted(places, key=lambda one: levels(tree[one])):
            if not getattr(tree[handle], "is_held", False):
                tree.set_matrix(handle, PARENT, places[handle])
        for handle in entries:
            index = self._index(handle)
            before = self._scene.factors.get(index, (1.0, 1.0, 1.0))
            self._scene.factors[index] = (x * before[0], y * before[1], z * before[2])

    def factors(self, handle: int) -> tuple[float, float, float]:
        """Return how many times as large an object is as it was, along x, y and z."""
        found = self._scene.tree[handle]
        index = self._index_of(found)
        x, y, z = (1.0, 1.0, 1.0) if index is None else self._scene.factors.get(index, (1.0, 1.0, 1.0))
        return x * found.size_factor, y * found.size_factor, z * found.size_factor

    def exchange(self, entries: Mapping[int, EntryParameters]) -> None:
        """Let other entries take the place of objects', whose names and places they have. Raises ParameterError."""
        scene = self._scene
        indices = {handle: self._index(handle) for handle in entries}
        new = entries.values()
        if any(isinstance(one, ObjectParameters) for one in new):
            others = [one for index, one in scene.entries.items() if index not in indices.values()]
            check_files(scene.parameters.floor, [*others, *new])

        def make_anew() -> None:
            for handle, index in indices.items():
                entry, before = entries[handle], scene.objects[index]
                if isinstance(entry, KindParameters):
                    place = Place(before.names, before.alias, before.parent, before.local)
                    scene.exchange(index, int(handle), entry, place)

        with self._changing(any(isinstance(one, _IN_DYNAMICS) for one in new), change_tree=make_anew):
            for handle, index in indices.items():
                place = {key: getattr(scene.entries[index], key) for key in ("position", "rpy", "parent")}
                scene.entries[index] = entries[handle].model_copy(update=place)
                scene.changed[index] += 1

    # ---- all or nothing

    @contextlib.contextmanager
    def _changing(self, bodies: bool = True, change_tree: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Let entries be changed inside `with`; then update world and tree or, where that fails, restore all."""
        scene = self._scene
        if bodies:
            scene.write_down_joints()
        kept, versions, number = dict(scene.entries), Counter(scene.changed), scene.next_index
        scripts = dict(scene.scripts)
        try:
            yield
            scene.renew(change_tree, bodies)
        except ValueError:
            scene.entries, scene.changed, scene.next_index, scene.scripts = kept, versions, number, scripts
            raise
        scene.is_changed = True
