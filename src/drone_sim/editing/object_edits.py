"""Operations on the objects of a scene."""

from __future__ import annotations

import copy
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drone_sim.config.errors import changed
from drone_sim.config.types import ParameterError, named_in
from drone_sim.editing import records
from drone_sim.editing.library import read_model_file
from drone_sim.files import writing
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_names import first_free, numbered
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.simulation import Simulation
from drone_sim.scene import geometry, models, scene_parameters
from drone_sim.scene.entry import EntryParameters, placed
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters, entry_from, script_from
from drone_sim.scripting.load import script_path

_DESCRIPTION_KEYS = ("alias", "category", "model")
_OPERATION_FOR = {"name": "rename", "parent": "reparent", "position": "move", "rpy": "move"}
_SIGN_ROWS, _SIGN_MARGIN = 64, 12  # px
_SIGN_HEIGHT, _SIGN_FOOT, _SIGN_THICKNESS = (
    0.4,
    1.0,
    0.02,
)  # m: board height, lower edge above the floor, board thickness
_SIGN_POST = {"shape": "cylinder", "size": [0.02, _SIGN_FOOT], "color": [0.3, 0.3, 0.32, 1.0]}
_LUA_TEMPLATE = """\
function sysCall_init()
    object = sim.getObject('.')
end

function sysCall_actuation()
end

function sysCall_sensing()
end

function sysCall_cleanup()
end
"""
_PYTHON_TEMPLATE = """\
def sysCall_init():
    self.object = sim.getObject('.')


def sysCall_actuation():
    pass


def sysCall_sensing():
    pass


def sysCall_cleanup():
    pass
"""
_TEMPLATES = {"lua": (".lua", _LUA_TEMPLATE), "python": (".py", _PYTHON_TEMPLATE)}


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
        folder, operations = self._simulation.document.folder, self._simulation.operations
        entries, scripts = read_model_file(op.model, folder, operations.imported).checked()
        at = frames.from_rpy(op.position, (0.0, 0.0, op.yaw))
        moved = [entry if entry.parent else placed(entry, "", frames.multiply(at, entry.local)) for entry in entries]
        if len(entries) == 1 and not op.model.endswith(".yaml") and isinstance(entries[0], ObjectParameters):
            moved = [_set_down(entries[0], op.position, op.yaw)]
        return operations.add_named_anew(moved, scripts)

    def add_sign(self, op: records.AddSign) -> list[int]:
        """Add a board on a post, legible from negative x; write its texture beside the scene.

        Raises also OSError.
        """
        image = _draw_sign(op.text)
        file = _write_sign(self._simulation.document.folder, op.text, image)
        width = _SIGN_HEIGHT * image.shape[1] / image.shape[0]
        operations = self._simulation.operations
        name = operations.free_name("Sign")
        board = {
            "name": name,
            "model": True,
            "shape": "box",
            "size": [width, _SIGN_THICKNESS, _SIGN_HEIGHT],
            "texture": file,
        }
        post = {"name": operations.free_name("SignPost"), "parent": name, **_SIGN_POST}
        at = frames.from_rpy(op.position, (0.0, 0.0, op.yaw - np.pi / 2))
        above = frames.from_rpy((0.0, 0.0, _SIGN_FOOT + _SIGN_HEIGHT / 2), (0.0, 0.0, 0.0))
        below = [0.0, 0.0, -(_SIGN_FOOT + _SIGN_HEIGHT) / 2]
        return operations.add([placed(entry_from(board), "", frames.multiply(at, above)), {**post, "position": below}])

    def remove(self, handles: Sequence[int], below: bool) -> None:
        """Remove objects; a model, or with `below` every object, is removed with its descendants except vehicles."""
        tree, operations = self._simulation.tree, self._simulation.operations
        removed: dict[int, None] = {}
        for top in handles:
            group = operations.model(top) if below or tree[top].is_model else [top]
            parts = (part for part in group if part == top or self._simulation.vehicle_of(part) is None)
            removed.update(dict.fromkeys(parts))
        operations.remove([*removed])

    def copy(self, handles: Sequence[int], places: Sequence[Vector]) -> list[int]:
        """Copy objects with their descendants, once for each of `places`: offsets (m, world) from the originals."""
        operations = self._simulation.operations
        originals = [*dict.fromkeys(part for handle in handles for part in operations.model(handle))]
        count, limit = len(places) * len(originals), scene_parameters.MAX_OBJECTS
        if count > limit:
            raise ValueError(f"{count} copies: a scene has at most {limit} objects")
        tree, copies = self._simulation.tree, []
        for place in places:
            new = dict(zip(originals, operations.copy(originals)))
            for handle in tree.tops(handles):
                operations.set_parent(new[handle], tree.handle_of(tree[handle].parent), keep_in_place=True)
                matrix = list(tree.matrix(handle))
                for index, distance in zip((3, 7, 11), place):
                    matrix[index] += distance
                self.put(new[handle], WORLD, tuple(matrix))
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
            script = self._script_of(self._simulation.tree[handle].name)
            files = {"script": script.script, "customization": script.customization}
            operations.attach_script(script_from({**script.model_dump(), **files, "parameters": parameters}))
        entry = operations.entry(handle)
        values = {key: _default(entry, key) if value is None else value for key, value in values.items()}
        scene_parameters.find_files_beside(self._simulation.document.folder, {"scene": {"objects": [values]}})
        described = {key: values.pop(key) for key in _DESCRIPTION_KEYS if key in values}
        if described:
            operations.describe(handle, **described)
        if "color" in values and isinstance(entry, ObjectParameters):
            operations.paint(handle, changed(entry, {"color": values.pop("color")}).color)
        return values

    def group(self, handles: Sequence[int], name: str, as_: str) -> list[int]:
        """Group objects into a compound shape, or into a model below a new dummy."""
        operations = self._simulation.operations
        if as_ == "shape":
            compound = operations.group(handles)
            return self.rename(compound, operations.free_name(name)) if name else [compound]
        handles = self._simulation.tree.tops(handles)
        matrices = [self._simulation.tree.matrix(handle) for handle in handles]
        middle = [sum(matrix[axis] for matrix in matrices) / len(matrices) for axis in (3, 7)]
        name = operations.free_name(name or "Model")
        (base,) = operations.add([{"name": name, "kind": "dummy", "model": True, "position": [*middle, 0.0]}])
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

    # ---- scripts

    def attach_script(self, op: records.AttachScript) -> None:
        """Attach a script to an object; without a file, create one beside the scene. Raises also OSError."""
        simulation, folder = self._simulation, self._simulation.document.folder
        name = simulation.tree[simulation.tree.resolve(op.object)].name
        path = named_in(folder, op.script or _create_script(folder, name, op.language))
        script_path(str(path))
        before = simulation.scene.scripts.get(name)
        kept = {"customization": before.customization} if before is not None else {}
        script = script_from({"object": name, "script": path, **kept, "parameters": dict(op.parameters)})
        simulation.operations.attach_script(script)

    def detach_script(self, op: records.DetachScript) -> None:
        name = self._simulation.tree[self._simulation.tree.resolve(op.object)].name
        self._script_of(name)
        self._simulation.operations.detach_script(name)

    def _script_of(self, name: str) -> AttachedScriptParameters:
        script = self._simulation.scene.scripts.get(name)
        if script is None:
            raise ValueError(f"'{name}' has no script of the scene")
        return script


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
        low, high = geometry.bounds(entry)
        rotation = frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)
        lowest = min(frames.transform(rotation, corner)[2] for corner in itertools.product(*zip(low, high)))
    pose = frames.from_rpy((x, y, z - float(lowest)), (0.0, 0.0, yaw))
    return placed(entry, "", frames.multiply(pose, frames.from_rpy((0.0, 0.0, 0.0), entry.rpy)))


def _create_script(folder: Path, name: str, language: str) -> str:
    """Write a new script from V-REP's template under an unused file name; return the name."""
    stem = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "script"
    suffix, template = _TEMPLATES[language]
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(1000):
        path = folder / f"{stem}{number or ''}{suffix}"
        if not path.exists():
            writing.write_new(path, template)
            return path.name
    raise ValueError(f"{folder}: already has a thousand scripts named {stem}")


def _draw_sign(text: str) -> np.ndarray:
    """Return an image (rows, columns, 3) of dark letters on white."""
    font, scale, thickness = cv2.FONT_HERSHEY_SIMPLEX, 1.4, 3
    (width, height), _ = cv2.getTextSize(text, font, scale, thickness)
    board = np.full((_SIGN_ROWS, max(width + 2 * _SIGN_MARGIN, _SIGN_ROWS), 3), 255, np.uint8)
    place = (board.shape[1] - width) // 2, (_SIGN_ROWS + height) // 2
    cv2.putText(board, text, place, font, scale, (40, 30, 30), thickness, cv2.LINE_AA)
    return board


def _write_sign(folder: Path, text: str, image: np.ndarray) -> str:
    """Write the texture unless the file has this content; return its name."""
    stem = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower() or "text"
    path = folder / f"sign_{stem}.png"
    content = cv2.imencode(".png", image)[1].tobytes()
    if not path.exists() or path.read_bytes() != content:
        folder.mkdir(parents=True, exist_ok=True)
        with writing.replacing(path, binary=True) as file:
            file.write(content)
    return named_in(folder, path.name)
