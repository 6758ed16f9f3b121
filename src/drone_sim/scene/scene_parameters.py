"""Parameters of a scene file: floor, objects, scripts, collections; checks of its entries and files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drone_sim.config.errors import problems
from drone_sim.config.types import (
    Checked,
    DatumParameters,
    File,
    FileName,
    Finite,
    FoundFile,
    Label,
    MagneticField,
    ParameterError,
    ParameterProblem,
    ScriptValue,
    Switch,
    Unit,
    Within,
    named_in,
    one_line,
    one_of,
    read_yaml,
)
from drone_sim.files import images, mesh_files
from drone_sim.files.resources import resolve
from drone_sim.mechanics.object_names import first_free, numbered
from drone_sim.mechanics.object_tree import DEEPEST
from drone_sim.message_text import near_names, shown
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.kinds.dummy import check_links
from drone_sim.scene.object_parameters import SHAPES, ObjectParameters

MAX_OBJECTS, MAX_SCRIPTS = 2000, 256
# These keys of a scene file take precedence over the parameters.
WORLD_KEYS = ("time_step", "sub_step", "gravity", "physics")
BESIDE = ("drone", "vehicles", "weather", *WORLD_KEYS)  # keys of a scene file that are not of the scene
MAX_TRIANGLES = 500_000  # of all meshes of a scene; a mesh counts once per use
MAX_PIXELS = 4 * images.MAX_SIDE**2  # of all textures of a scene
MAX_REACH = 1e5  # m, distance of a mesh's vertices from its origin
_MAX_SCRIPT_PARAMETERS = 256  # per script
_MAX_COLLECTIONS, _MAX_ITEMS = 256, 10_000
_VREP_NAMES = {"box": "Cuboid", "mesh": "Shape", "compound": "Shape", "urdf": "Shape"}


class FloorParameters(Checked):
    """A square floor at z = 0, centred on the origin, surrounded by ground or, if `edge`, by nothing."""

    size: Annotated[Finite, Within(0.01, 1e4), Unit("m")]
    texture: File
    edge: Switch


class AttachedScriptParameters(Checked):
    """A child script on the object named `object`, of the scene or of a vehicle, a customization script, or both.

    `embedded`: `..` in its paths is that object's parent, as up to CoppeliaSim 4.8, and not the object itself.
    """

    object: Label
    script: FileName = ""
    customization: FileName = ""
    embedded: Switch = False
    parameters: Annotated[dict[Label, ScriptValue], Field(default_factory=dict, max_length=_MAX_SCRIPT_PARAMETERS)]


class ItemParameters(Checked):
    """Members of a collection: an object, its descendants (tree), its ancestors (chain), or all objects.

    `removes`: remove them from the members of the preceding items; `without`: tree or chain without the object itself.
    """

    what: Literal["single", "tree", "chain", "all"]
    object: Label = ""
    removes: Switch = False
    without: Switch = False

    def model_post_init(self, _context: Any) -> None:
        """Raise ParameterError for an item without the object that it needs."""
        if not self.object and self.what != "all":
            raise ParameterError(f"a {self.what} needs the name of an object", ("object",), "''")


class CollectionParameters(Checked):
    """A collection."""

    name: Annotated[Label, Field(min_length=1)]
    items: Annotated[list[ItemParameters], Field(max_length=_MAX_ITEMS)]


if TYPE_CHECKING:
    EntryChoice = EntryParameters
else:
    EntryChoice = one_of(*SHAPES, *KINDS, key="shape", or_key="kind")


class SceneParameters(Checked):
    """The world without vehicles."""

    datum: DatumParameters
    magnetic_field: MagneticField
    floor: FloorParameters
    objects: Annotated[list[EntryChoice], Field(max_length=MAX_OBJECTS)]
    scripts: Annotated[list[AttachedScriptParameters], Field(max_length=MAX_SCRIPTS)]
    collections: Annotated[list[CollectionParameters], Field(max_length=_MAX_COLLECTIONS)]

    def model_post_init(self, _context: Any) -> None:
        """Name the shapes that have no name; check names, parents, links, scripts and collections."""
        name_shapes(self.objects)
        _check_unique("objects", "name", self.objects)
        check_parents(self.objects)
        check_links(self.objects)
        _check_unique("scripts", "object", self.scripts)
        for index, script in enumerate(self.scripts):
            if not script.script and not script.customization:
                raise ParameterError("no file", ("scripts", index, "script"), "''")
        _check_unique("collections", "name", self.collections)


def _check_unique(section: str, key: str, items: Iterable[Checked]) -> None:
    values: set[str] = set()
    for index, item in enumerate(items):
        value = getattr(item, key)
        if value in values:
            raise ParameterError("is used twice", (section, index, key), f"'{value}'")
        values.add(value)


def name_shapes(objects: list[EntryChoice]) -> None:
    """Name the shapes that have no name as V-REP names new ones: Cuboid, Cuboid0, Cuboid1, ..."""
    taken = {entry.name for entry in objects}
    free: dict[str, Iterator[str]] = {}
    for index, entry in enumerate(objects):
        if not entry.name and isinstance(entry, ObjectParameters):
            word = _VREP_NAMES.get(entry.shape, entry.shape.capitalize())
            name = first_free(free.setdefault(word, numbered(word)), taken)
            objects[index] = entry.model_copy(update={"name": name, "alias": word if name != word else ""})


def check_parents(objects: Iterable[EntryParameters]) -> None:
    """Raise ParameterError for an entry that is its own ancestor or has too many ancestors."""
    entries = {entry.name: entry for entry in objects}
    for index, entry in enumerate(entries.values()):
        ancestors: set[str] = set()  # also the entry itself if the parents form a cycle
        name = entry.parent
        while name and name in entries and name not in ancestors:
            ancestors.add(name)
            name = entries[name].parent
        where, value = ("objects", index, "parent"), f"'{entry.parent}'"
        if entry.name in ancestors:
            raise ParameterError(f"'{entry.name}' would be its own ancestor", where, value)
        if len(ancestors) > DEEPEST:
            raise ParameterError(f"'{entry.name}' has more than {DEEPEST} ancestors", where, value)


# ---- reading

_Value = TypeVar("_Value")
# Built when a single entry is first read, which few simulations do.
_ENTRY: TypeAdapter[EntryParameters] = TypeAdapter(EntryChoice, config=ConfigDict(defer_build=True))
_SCRIPT = TypeAdapter(AttachedScriptParameters)


def entry_from(values: Mapping[str, Any]) -> EntryParameters:
    """Return a checked entry; the default `position` is the parent's origin. Raises ParameterError."""
    return _checked(_ENTRY, EntryChoice, {"position": [0.0, 0.0, 0.0], **values})


def script_from(values: Mapping[str, Any]) -> AttachedScriptParameters:
    """Return a checked entry of `scripts`. Raises ParameterError."""
    return _checked(_SCRIPT, AttachedScriptParameters, values)


def _checked(adapter: TypeAdapter[_Value], kind: Any, values: Mapping[str, Any]) -> _Value:
    try:
        return adapter.validate_python(values)
    except ValidationError as error:
        raise ParameterError(one_line([(None, problem.text) for problem in problems(error, kind)])) from None


def read(file: str) -> dict[str, Any]:
    """Return the content of a scene file in the layout of the parameters: `scene`, `drone`, `weather` and so on.

    File names in it (mesh, urdf, texture) are relative to the scene file. Raises ParameterError.
    """
    try:
        path = resolve(file)
    except FileNotFoundError as error:
        raise ParameterError(str(error), ("scene_file",), shown(file)) from None
    return from_content(read_yaml(path), path.parent)


def from_content(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return the same as `read`, given a scene file's content."""
    scene = {key: value for key, value in content.items() if key not in BESIDE}  # unknown keys are reported later
    result = {"scene": scene, **{key: content[key] for key in BESIDE if key in content}}
    find_files_beside(folder, result)
    return result


def find_files_beside(folder: Path, values: Mapping[str, Any]) -> None:
    """Resolve the file names in `scene`, `drone` and `vehicles` relative to a folder, in place."""
    scene = values.get("scene")
    inner = scene if isinstance(scene, dict) else {}
    places = [inner.get("floor"), *_listed(inner.get("objects")), *_listed(inner.get("scripts"))]
    vehicles = values.get("vehicles")
    entries = vehicles.values() if isinstance(vehicles, dict) else ()
    for place in (values.get("drone"), *places, *entries):
        _resolve_files(folder, place)


def problem_in_file(problem: ParameterProblem) -> ParameterProblem | None:
    """Return a problem with its location in the scene file; None if it is not of the scene file."""
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
    return objects if isinstance(objects, list) else []  # other types are reported with the other problems


def _resolve_files(folder: Path, values: Any) -> None:
    for part in _listed(values.get("parts")) if isinstance(values, dict) else []:
        _resolve_files(folder, part)
    for key in ("file", "texture", "urdf", "script", "customization"):
        name = values.get(key) if isinstance(values, dict) else None
        if key == "script" and not Path(str(name)).suffix:  # built-in scripts such as tutorial and target have none
            continue
        if isinstance(name, str) and name and not hasattr(name, "given"):  # a YAML alias repeats the same mapping
            values[key] = named_in(folder, name)


def renamed_files(value: Any, name: Callable[[FoundFile], str]) -> Any:
    """Return values with `name` of each file that `find_files_beside` has resolved."""
    if isinstance(value, Mapping):
        return {key: renamed_files(item, name) for key, item in value.items()}
    if isinstance(value, list):
        return [renamed_files(item, name) for item in value]
    return name(value) if isinstance(value, FoundFile) else value


def check_files(floor: FloorParameters, objects: Iterable[EntryParameters]) -> None:
    """Raise ParameterError with a message of one line for the first file of the scene that cannot be used."""
    shapes = [entry for entry in objects if isinstance(entry, ObjectParameters)]
    pixels = triangles = 0
    try:
        for path in sorted({floor.texture, *(shape.texture for shape in shapes if shape.texture)}):
            height, width = images.read(path).shape[:2]
            pixels += height * width
            if pixels > MAX_PIXELS:
                why = f"the textures of the scene have more than {MAX_PIXELS} pixels together"
                raise ValueError(f"texture {path}: {why}")
        for path, scale in (mesh for shape in shapes for mesh in shape.to_shape().meshes()):
            triangles += mesh_files.triangles(path)
            if triangles > MAX_TRIANGLES:
                why = f"the meshes of the scene have more than {MAX_TRIANGLES} triangles together"
                raise ValueError(f"mesh {path}: {why}")
            reach = float(np.max(mesh_files.reach(path) * np.abs(scale)))
            if reach > MAX_REACH:
                why = f"reaches {reach:g} m from its origin; at most {MAX_REACH:g} m are allowed"
                raise ValueError(f"mesh {path}: {why}")
    except ValueError as error:
        raise ParameterError(" ".join(str(error).split())) from None
