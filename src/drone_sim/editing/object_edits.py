"""Operations on the objects of a scene."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError
from drone_sim.editing import records, scripts
from drone_sim.editing.library import model_said
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_names import numbered
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters, placed
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import entry_from, name_shapes, script_from

_DESCRIPTION = ("alias", "category", "model")
_OTHERWISE = {"name": "rename", "parent": "reparent", "position": "move", "rpy": "move"}


class ObjectEdits:
    """Each operation returns the handles of what it has made, or touched. All raise ValueError."""

    def __init__(self, scene: SceneAccess):
        """Take the scene."""
        self._scene = scene

    # ---- come and go

    def add(self, said: records.Add) -> list[int]:
        """Add entries under free names."""
        content = {"scene": {"objects": copy.deepcopy(said.objects), "scripts": copy.deepcopy(said.scripts)}}
        scene_parameters.find_files_beside(self._scene.folder, content)
        entries = [entry_from(one) for one in content["scene"]["objects"]]
        name_shapes(entries)
        if said.position is not None:
            entries[0] = _landed(entries[0], said.position, said.yaw)
        return self._add_as_free(entries, [script_from(one) for one in content["scene"]["scripts"]])

    def _add_as_free(
        self, entries: Sequence[EntryParameters], scripts: Sequence[AttachedScriptParameters]
    ) -> list[int]:
        tree = self._scene.tree
        new: dict[str, str] = {}
        for one in entries:
            new[one.name] = next(name for name in numbered(one.name) if name not in tree and name not in new.values())
        made = [
            one.model_copy(update={"name": new[one.name], "parent": new.get(one.parent, one.parent)}) for one in entries
        ]
        on = [one.model_copy(update={"object": new.get(one.object, one.object)}) for one in scripts]
        return self._scene.operations.add(made, on)

    def add_model(self, said: records.AddModel) -> list[int]:
        """Add what a file has, its origin at a place."""
        model = model_said(said.model, self._scene.folder, self._scene.operations.imported)
        entries = [entry_from(one) for one in model.objects]
        name_shapes(entries)
        at = frames.from_rpy(said.position, (0.0, 0.0, said.yaw))
        placed_ones = [one if one.parent else placed(one, "", frames.multiply(at, one.local)) for one in entries]
        if len(entries) == 1 and not said.model.endswith(".yaml") and isinstance(entries[0], ObjectParameters):
            placed_ones = [_landed(entries[0], said.position, said.yaw)]
        return self._scene.operations.add_named_anew(placed_ones, [script_from(one) for one in model.scripts])

    def remove(self, handles: Sequence[int], below: bool) -> list[int]:
        """Remove objects; a model with all that hangs on it."""
        tree, operations = self._scene.tree, self._scene.operations
        going: dict[int, None] = {}
        for one in handles:
            whole = operations.model(one) if below or tree[one].is_model else [one]
            going.update(dict.fromkeys(part for part in whole if part == one or self._scene.vehicle_of(part) is None))
        operations.remove([*going])
        return []

    def copy(self, handles: Sequence[int], places: Sequence[Vector]) -> list[int]:
        """Copy objects with what hangs on them, each so far (m, world) from the original."""
        operations = self._scene.operations
        whole = [*dict.fromkeys(part for one in handles for part in operations.model(one))]
        if len(places) * len(whole) > scene_parameters.MAX_OBJECTS:
            raise ValueError(
                f"{len(places) * len(whole)} copies: a scene has at most {scene_parameters.MAX_OBJECTS} objects"
            )
        made = []
        for place in places:
            new = dict(zip(whole, operations.copy(whole)))
            for one in self._scene.tops(handles):
                self._shift(new[one], one, place)
            made += [new[one] for one in handles]
        return made

    def described(self, handles: Sequence[int]) -> tuple[list[EntryParameters], list[AttachedScriptParameters]]:
        """Return objects and what hangs on them as a scene file would say them, the first ones in the world."""
        tree, operations, scripts = self._scene.tree, self._scene.operations, self._scene.simulation.scene.scripts
        tops = self._scene.tops(handles)
        entries = []
        for one in dict.fromkeys(part for top in tops for part in operations.model(top)):
            if self._scene.vehicle_of(one) is None:
                entry = operations.entry(one)
                entries.append(placed(entry, "", tree.matrix(one)) if one in tops else entry)
        return entries, [scripts[one.name] for one in entries if one.name in scripts]

    def _shift(self, copied: int, original: int, by: Sequence[float]) -> None:
        """Hang a copy where the original hangs, so far from it (m, world)."""
        tree, operations = self._scene.tree, self._scene.operations
        operations.set_parent(copied, tree.handle_of(tree[original].parent), keep_in_place=True)
        matrix = list(tree.matrix(original))
        for index, distance in zip((3, 7, 11), by):
            matrix[index] += distance
        self.put(copied, WORLD, tuple(matrix))

    # ---- names, parents, places

    def rename(self, handle: int, name: str) -> list[int]:
        """Give an object another name, and alias."""
        self._scene.operations.rename(handle, name)
        if self._scene.operations.entry(handle).alias:
            self._scene.operations.describe(handle, alias="")
        return [handle]

    def reparent(self, handle: int, parent: int, keep: str) -> None:
        """Hang an object on another."""
        local = self._scene.tree.matrix(handle, PARENT)
        self._scene.operations.set_parent(handle, parent, keep_in_place=True)
        if keep == "relative":
            self._scene.operations.put(handle, local)

    def put(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Put an object at a transform relative to another."""
        tree = self._scene.tree
        above = tree[handle].parent
        if relative_to not in (PARENT, WORLD):
            matrix = frames.multiply(tree[relative_to].below(), matrix)
        if relative_to != PARENT and above is not None:
            matrix = frames.relative(above.below(), matrix)
        self._scene.operations.put(handle, matrix)

    # ---- what they are like

    def set(self, said: Mapping[int, Mapping[str, Any]]) -> None:
        """Give entries, by handle, other values, all at once, so that the world is rebuilt only once."""
        operations = self._scene.operations
        rest = {handle: self._look_otherwise(handle, values) for handle, values in said.items()}
        entries = {handle: operations.entry_with(handle, values) for handle, values in rest.items() if values}
        if entries:
            operations.exchange(entries)

    def _look_otherwise(self, handle: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set the values that need no new body in the world; return the values that are left."""
        for key, word in _OTHERWISE.items():
            if key in values:
                raise ParameterError(f"{key}: cannot be set here; use the operation `{word}`")
        operations, values = self._scene.operations, dict(values)
        parameters = values.pop("script_parameters", None)
        if parameters is not None:
            scripts.set_parameters(self._scene, handle, parameters)
        entry = operations.entry(handle)
        values = {key: _default(entry, key) if value is None else value for key, value in values.items()}
        self._find_files(values)
        described = {key: values.pop(key) for key in _DESCRIPTION if key in values}
        if described:
            operations.describe(handle, **described)
        if "color" in values and isinstance(entry, ObjectParameters):
            operations.paint(handle, changed(entry, {"color": values.pop("color")}).color)
        return values

    def _find_files(self, values: dict[str, Any]) -> None:
        scene_parameters.find_files_beside(self._scene.folder, {"scene": {"objects": [values]}})

    def scale(self, handles: Sequence[int], factors: tuple[float, float, float]) -> None:
        """Let objects be so many times as large."""
        self._scene.operations.scale(handles, factors)

    def group(self, handles: Sequence[int], name: str, as_: str) -> list[int]:
        """Make one of several."""
        operations = self._scene.operations
        if as_ == "shape":
            made = operations.group(handles)
            return self.rename(made, operations.free_name(name)) if name else [made]
        handles = self._scene.tops(handles)
        places = [self._scene.tree.matrix(one) for one in handles]
        middle = [sum(one[axis] for one in places) / len(places) for axis in (3, 7)]
        said = {
            "name": operations.free_name(name or "Model"),
            "kind": "dummy",
            "model": True,
            "position": [*middle, 0.0],
        }
        (base,) = operations.add([said])
        for one in handles:
            operations.set_parent(one, base, keep_in_place=True)
        return [base]

    def ungroup(self, handle: int) -> list[int]:
        """Make several of one."""
        operations, tree = self._scene.operations, self._scene.tree
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


def _landed(entry: EntryParameters, position: Sequence[float], yaw: float) -> EntryParameters:
    """Return an entry whose lowest point is at the height of a place in the world."""
    x, y, z = position
    lowest = 0.0
    if isinstance(entry, ObjectParameters) and entry.shape != "urdf":
        low, high = models.bounds(entry)
        turn = frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)
        lowest = min(frames.transform(turn, corner)[2] for corner in itertools.product(*zip(low, high)))
    at = frames.from_rpy((x, y, z - float(lowest)), (0.0, 0.0, yaw))
    return placed(entry, "", frames.multiply(at, frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)))
