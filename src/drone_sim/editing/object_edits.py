"""Operations on the objects of a scene."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError
from drone_sim.editing import records
from drone_sim.editing.library import read_model_file
from drone_sim.editing.scripts import set_parameters
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_names import first_free, numbered
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.simulation import Simulation
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.entry import EntryParameters, placed
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

_DESCRIPTION_KEYS = ("alias", "category", "model")
_OPERATION_FOR = {"name": "rename", "parent": "reparent", "position": "move", "rpy": "move"}


class ObjectEdits:
    """Operations on scene objects; each returns the handles of created or changed objects. All raise ValueError."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation

    # ---- adding and removing

    def add(self, op: records.Add) -> list[int]:
        """Add entries under unused names."""
        content = {"objects": copy.deepcopy(op.objects), "scripts": copy.deepcopy(op.scripts)}
        scene_parameters.find_files_beside(self._simulation.document.folder, {"scene": content})
        entries, scripts = models.Model(**content).checked()
        if op.position is not None:
            entries[0] = _set_down(entries[0], op.position, op.yaw)
        tree = self._simulation.tree
        renames: dict[str, str] = {}
        for entry in entries:
            renames[entry.name] = first_free(numbered(entry.name), tree, renames.values())
        renamed = [
            entry.model_copy(update={"name": renames[entry.name], "parent": renames.get(entry.parent, entry.parent)})
            for entry in entries
        ]
        moved = [it.model_copy(update={"object": renames.get(it.object, it.object)}) for it in scripts]
        return self._simulation.operations.add(renamed, moved)

    def add_model(self, op: records.AddModel) -> list[int]:
        """Add the objects of a model, with its origin at `position`."""
        entries, scripts = read_model_file(
            op.model, self._simulation.document.folder, self._simulation.operations.imported
        ).checked()
        at = frames.from_rpy(op.position, (0.0, 0.0, op.yaw))
        moved = [entry if entry.parent else placed(entry, "", frames.multiply(at, entry.local)) for entry in entries]
        if len(entries) == 1 and not op.model.endswith(".yaml") and isinstance(entries[0], ObjectParameters):
            moved = [_set_down(entries[0], op.position, op.yaw)]
        return self._simulation.operations.add_named_anew(moved, scripts)

    def remove(self, handles: Sequence[int], below: bool) -> list[int]:
        """Remove objects; a model, or with `below` every object, is removed with its descendants except vehicles."""
        tree, operations = self._simulation.tree, self._simulation.operations
        removed: dict[int, None] = {}
        for top in handles:
            group = operations.model(top) if below or tree[top].is_model else [top]
            removed.update(
                dict.fromkeys(part for part in group if part == top or self._simulation.vehicle_of(part) is None)
            )
        operations.remove([*removed])
        return []

    def copy(self, handles: Sequence[int], places: Sequence[Vector]) -> list[int]:
        """Copy objects with their descendants, once for each of `places`: offsets (m, world) from the originals."""
        operations = self._simulation.operations
        originals = [*dict.fromkeys(part for handle in handles for part in operations.model(handle))]
        if len(places) * len(originals) > scene_parameters.MAX_OBJECTS:
            raise ValueError(
                f"{len(places) * len(originals)} copies: a scene has at most {scene_parameters.MAX_OBJECTS} objects"
            )
        copies = []
        for place in places:
            new = dict(zip(originals, operations.copy(originals)))
            for handle in self._simulation.tree.tops(handles):
                self._shift(new[handle], handle, place)
            copies += [new[handle] for handle in handles]
        return copies

    def described(self, handles: Sequence[int]) -> tuple[list[EntryParameters], list[AttachedScriptParameters]]:
        """Return the entries and scripts of objects and their descendants; the topmost are in the world frame."""
        tree, operations, scripts = self._simulation.tree, self._simulation.operations, self._simulation.scene.scripts
        tops = self._simulation.tree.tops(handles)
        entries = []
        for handle in dict.fromkeys(part for top in tops for part in operations.model(top)):
            if self._simulation.vehicle_of(handle) is None:
                entry = operations.entry(handle)
                entries.append(placed(entry, "", tree.matrix(handle)) if handle in tops else entry)
        return entries, [scripts[entry.name] for entry in entries if entry.name in scripts]

    def _shift(self, copied: int, original: int, by: Sequence[float]) -> None:
        """Give a copy the original's parent and place it at an offset (m, world) from the original."""
        tree, operations = self._simulation.tree, self._simulation.operations
        operations.set_parent(copied, tree.handle_of(tree[original].parent), keep_in_place=True)
        matrix = list(tree.matrix(original))
        for index, distance in zip((3, 7, 11), by):
            matrix[index] += distance
        self.put(copied, WORLD, tuple(matrix))

    # ---- names, parents, places

    def rename(self, handle: int, name: str) -> list[int]:
        """Rename an object and reset its alias to the name."""
        self._simulation.operations.rename(handle, name)
        if self._simulation.operations.entry(handle).alias:
            self._simulation.operations.describe(handle, alias="")
        return [handle]

    def reparent(self, handle: int, parent: int, keep: str) -> None:
        """Set an object's parent; `keep`: the pose in the world, or the one relative to the parent."""
        local = self._simulation.tree.matrix(handle, PARENT)
        self._simulation.operations.set_parent(handle, parent, keep_in_place=True)
        if keep == "relative":
            self._simulation.operations.put(handle, local)

    def put(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Set an object's pose relative to its parent, the world, or another object."""
        tree = self._simulation.tree
        parent = tree[handle].parent
        if relative_to not in (PARENT, WORLD):
            matrix = frames.multiply(tree[relative_to].below(), matrix)
        if relative_to != PARENT and parent is not None:
            matrix = frames.relative(parent.below(), matrix)
        self._simulation.operations.put(handle, matrix)

    # ---- properties

    def set(self, values_by_handle: Mapping[int, Mapping[str, Any]]) -> None:
        """Set keys of entries, by handle, all at once, so that the world is rebuilt only once."""
        operations = self._simulation.operations
        rest = {handle: self._set_simple(handle, values) for handle, values in values_by_handle.items()}
        entries = {handle: operations.entry_with(handle, values) for handle, values in rest.items() if values}
        if entries:
            operations.replace_entries(entries)

    def _set_simple(self, handle: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set the keys that do not need a new body in the world; return the others."""
        for key, operation in _OPERATION_FOR.items():
            if key in values:
                raise ParameterError(f"{key}: cannot be set here; use the operation `{operation}`")
        operations, values = self._simulation.operations, dict(values)
        parameters = values.pop("script_parameters", None)
        if parameters is not None:
            set_parameters(self._simulation, handle, parameters)
        entry = operations.entry(handle)
        values = {key: _default(entry, key) if value is None else value for key, value in values.items()}
        scene_parameters.find_files_beside(self._simulation.document.folder, {"scene": {"objects": [values]}})
        described = {key: values.pop(key) for key in _DESCRIPTION_KEYS if key in values}
        if described:
            operations.describe(handle, **described)
        if "color" in values and isinstance(entry, ObjectParameters):
            operations.paint(handle, changed(entry, {"color": values.pop("color")}).color)
        return values

    def scale(self, handles: Sequence[int], factors: tuple[float, float, float]) -> None:
        """Scale objects by factors along their own axes."""
        self._simulation.operations.scale(handles, factors)

    def group(self, handles: Sequence[int], name: str, as_: str) -> list[int]:
        """Group objects into a compound shape, or into a model below a new dummy."""
        operations = self._simulation.operations
        if as_ == "shape":
            compound = operations.group(handles)
            return self.rename(compound, operations.free_name(name)) if name else [compound]
        handles = self._simulation.tree.tops(handles)
        matrices = [self._simulation.tree.matrix(handle) for handle in handles]
        middle = [sum(matrix[axis] for matrix in matrices) / len(matrices) for axis in (3, 7)]
        entry = {
            "name": operations.free_name(name or "Model"),
            "kind": "dummy",
            "model": True,
            "position": [*middle, 0.0],
        }
        (base,) = operations.add([entry])
        for handle in handles:
            operations.set_parent(handle, base, keep_in_place=True)
        return [base]

    def ungroup(self, handle: int) -> list[int]:
        """Split a compound into its parts, or a model into independent objects."""
        operations, tree = self._simulation.operations, self._simulation.tree
        if not tree[handle].is_model:
            return operations.ungroup(handle)
        children = [child for child, _ in tree.children(tree[handle])]
        if tree[handle].kind == "dummy":
            operations.remove([handle])
        else:
            operations.describe(handle, model=False)
        return children


def _default(entry: EntryParameters, key: str) -> Any:
    field = type(entry).model_fields.get(key)
    if field is None or field.is_required():
        raise ParameterError(f"{key}: cannot be reset, because it has no default")
    return field.get_default(call_default_factory=True)


def _set_down(entry: EntryParameters, position: Sequence[float], yaw: float) -> EntryParameters:
    """Return the entry at a position in the world such that its lowest point is at the position's height."""
    x, y, z = position
    lowest = 0.0
    if isinstance(entry, ObjectParameters) and entry.shape != "urdf":
        low, high = models.bounds(entry)
        rotation = frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)
        lowest = min(frames.transform(rotation, corner)[2] for corner in itertools.product(*zip(low, high)))
    pose = frames.from_rpy((x, y, z - float(lowest)), (0.0, 0.0, yaw))
    return placed(entry, "", frames.multiply(pose, frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)))
