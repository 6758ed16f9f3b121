"""What a scene file may say: floor, objects, where the drone stands, and the weather."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drone_sim.config.errors import problems
from drone_sim.config.types import (
    Checked,
    DatumParameters,
    File,
    Finite,
    MagneticField,
    ParameterError,
    ParameterProblem,
    Switch,
    Within,
    named_in,
    one_line,
    one_of,
    read_yaml,
)
from drone_sim.files import images, mesh_files
from drone_sim.files.resources import resolve
from drone_sim.mechanics.object_names import numbered
from drone_sim.mechanics.object_tree import DEEPEST
from drone_sim.message_text import near_names, shown
from drone_sim.scene import attached_scripts, object_collections
from drone_sim.scene.attached_scripts import AttachedScriptParameters, AttachedScripts
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.object_collections import CollectionList
from drone_sim.scene.object_parameters import SHAPES, ObjectParameters

MAX_OBJECTS = 2000
# What a scene file may say of these comes before the parameters.
WORLD_KEYS = ("time_step", "sub_step", "gravity", "physics")
BESIDE = ("drone", "vehicles", "weather", *WORLD_KEYS)  # what a scene file holds besides the scene
MAX_TRIANGLES = 500_000  # of all meshes of a scene, each counted as often as it stands there
MAX_PIXELS = 4 * images.MAX_SIDE**2  # of all its textures
MAX_REACH = 1e5  # m, of a mesh from its own origin


class FloorParameters(Checked):
    """A square floor at z = 0, centred on the origin; around it is ground, or nothing where `edge` is true."""

    size: Annotated[Finite, Within(0.01, 1e4)]
    texture: File
    edge: Switch


if TYPE_CHECKING:
    EntryChoice = EntryParameters
else:
    EntryChoice = one_of(*SHAPES, *KINDS, key="shape", or_key="kind")


_Value = TypeVar("_Value")
_VREPS_WORDS = {"box": "Cuboid", "mesh": "Shape", "compound": "Shape", "urdf": "Shape"}
# Made when an entry is first read by itself, which few simulations need.
_ENTRY: TypeAdapter[EntryParameters] = TypeAdapter(EntryChoice, config=ConfigDict(defer_build=True))
_SCRIPT = TypeAdapter(AttachedScriptParameters)


def entry_from(said: Mapping[str, Any]) -> EntryParameters:
    """Return what an entry says, checked; without a `position` it is at its parent's. Raises ParameterError."""
    return _checked(_ENTRY, EntryChoice, {"position": [0.0, 0.0, 0.0], **said})


def script_from(said: Mapping[str, Any]) -> AttachedScriptParameters:
    """Return what an entry of `scripts` says, checked. Raises ParameterError."""
    return _checked(_SCRIPT, AttachedScriptParameters, said)


def _checked(adapter: TypeAdapter[_Value], kind: Any, said: Mapping[str, Any]) -> _Value:
    try:
        return adapter.validate_python(said)
    except ValidationError as error:
        raise ParameterError(one_line([(None, one.text) for one in problems(error, kind)])) from None


class SceneParameters(Checked):
    """The world without the drone."""

    datum: DatumParameters
    magnetic_field: MagneticField
    floor: FloorParameters
    objects: Annotated[list[EntryChoice], Field(max_length=MAX_OBJECTS)]
    scripts: AttachedScripts
    collections: CollectionList

    def model_post_init(self, _context: Any) -> None:
        """Give a name to objects without one; check what concerns several objects at once."""
        name_shapes(self.objects)
        names: set[str] = set()
        for index, one in enumerate(self.objects):
            if one.name in names:
                raise _refused(index, "name", one.name, "is used twice")
            names.add(one.name)
        check_parents(self.objects)
        attached_scripts.check(self.scripts)
        object_collections.check(self.collections)


def name_shapes(objects: list[EntryChoice]) -> None:
    """Let shapes without a name be called as V-REP calls new ones: Cuboid, Cuboid0, Cuboid1, ..."""
    taken = {one.name for one in objects}
    free: dict[str, Iterator[str]] = {}
    for index, one in enumerate(objects):
        if not one.name and isinstance(one, ObjectParameters):
            word = _VREPS_WORDS.get(one.shape, one.shape.capitalize())
            names = free.setdefault(word, (other for other in numbered(word) if other not in taken))
            name = next(names)
            objects[index] = one.model_copy(update={"name": name, "alias": word if name != word else ""})


def _refused(index: int, key: str, value: str, why: str) -> ParameterError:
    return ParameterError(why, ("objects", index, key), f"'{value}'")


def check_parents(objects: Iterable[EntryParameters]) -> None:
    """Raise ParameterError for one of some entries that hangs on itself, or too deep below the others."""
    entries = {one.name: one for one in objects}
    for index, one in enumerate(entries.values()):
        above = _above(one, entries)
        if one.name in above:
            raise _refused(index, "parent", one.parent, f"'{one.name}' would be its own ancestor")
        if len(above) > DEEPEST:
            raise _refused(index, "parent", one.parent, f"'{one.name}' has more than {DEEPEST} ancestors")


def _above(one: EntryParameters, entries: Mapping[str, EntryParameters]) -> dict[str, None]:
    """Return the names of the entries that one hangs on, by way of others, too; its own where it does."""
    above: dict[str, None] = {}
    name = one.parent
    while name and name in entries and name not in above:
        above[name] = None
        name = entries[name].parent
    return above


def read(file: str) -> dict[str, Any]:
    """Return a scene file's floor, objects, drone and weather as they stand among the parameters.

    Its own files (mesh, urdf, texture) are relative to it. Raises ParameterError.
    """
    try:
        path = resolve(file)
    except FileNotFoundError as error:
        raise ParameterError(str(error), ("scene_file",), shown(file)) from None
    return from_content(read_yaml(path), path.parent)


def from_content(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return what `read` does, of a scene file's content."""
    scene = {key: value for key, value in content.items() if key not in BESIDE}  # the unknown are refused with the rest
    found = {"scene": scene, **{key: content[key] for key in BESIDE if key in content}}
    find_files_beside(folder, found)
    return found


def find_files_beside(folder: Path, values: Mapping[str, Any]) -> None:
    """Let the file names among `scene` and `drone` lead to files in a folder."""
    scene = values.get("scene")
    inside = scene if isinstance(scene, dict) else {}
    places = [inside.get("floor"), *_listed(inside.get("objects")), *_listed(inside.get("scripts"))]
    vehicles = values.get("vehicles")
    entries = vehicles.values() if isinstance(vehicles, dict) else ()
    for place in (values.get("drone"), *places, *entries):
        _find_beside(folder, place)


def problem_in_file(problem: ParameterProblem) -> ParameterProblem | None:
    """Return a problem as the scene file has it, where they stand beside the drone; None for any other."""
    if problem.location[:1] in [(key,) for key in BESIDE]:
        return problem
    if problem.location[:1] != ("scene",):
        return None
    inner = problem._replace(location=problem.location[1:])
    if len(inner.location) == 1 and inner.location[0] not in SceneParameters.model_fields:
        near = near_names(str(inner.location[0])[:80], [*SceneParameters.model_fields, *BESIDE])
        return inner._replace(reason=f"unknown key; {near}")
    return inner


def _listed(objects: Any) -> list[Any]:
    return objects if isinstance(objects, list) else []  # what is no list is refused with the other values


def _find_beside(folder: Path, place: Any) -> None:
    for part in _listed(place.get("parts")) if isinstance(place, dict) else []:
        _find_beside(folder, part)
    for key in ("file", "texture", "urdf", "script"):
        name = place.get(key) if isinstance(place, dict) else None
        if key == "script" and not Path(str(name)).suffix:  # tutorial and target have none
            continue
        if isinstance(name, str) and name and not hasattr(name, "given"):  # an alias is the same mapping once more
            place[key] = named_in(folder, name)


# ---- meshes, textures and URDFs, looked through and counted before anything is made of them


def check_files(floor: FloorParameters, objects: Iterable[EntryParameters]) -> None:
    """Raise ParameterError, in one line, for the first file of the scene that cannot be used."""
    try:
        shapes = [one for one in objects if isinstance(one, ObjectParameters)]
        _check_textures({floor.texture, *(one.texture for one in shapes if one.texture)})
        _check_meshes(shapes)
    except ValueError as error:
        raise ParameterError(" ".join(str(error).split())) from None


def _check_textures(paths: set[str]) -> None:
    pixels = 0
    for path in sorted(paths):
        height, width = images.read(path).shape[:2]
        pixels += height * width
        if pixels > MAX_PIXELS:
            raise ValueError(f"texture {path}: the textures of the scene have more than {MAX_PIXELS} pixels together")


def _check_meshes(shapes: list[ObjectParameters]) -> None:
    count = 0
    for path, scale in (mesh for one in shapes for mesh in one.to_shape().meshes()):
        count += mesh_files.triangles(path)
        if count > MAX_TRIANGLES:
            raise ValueError(f"mesh {path}: the meshes of the scene have more than {MAX_TRIANGLES} triangles together")
        reach = float(np.max(mesh_files.reach(path) * np.abs(scale)))
        if reach > MAX_REACH:
            raise ValueError(f"mesh {path}: reaches {reach:g} m from its origin; at most {MAX_REACH:g} m are allowed")
