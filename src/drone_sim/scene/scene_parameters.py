"""What a scene file may say: floor, objects, where the drone stands, and the weather."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from drone_sim.config.errors import Problem
from drone_sim.config.place import DatumParameters, MagneticField
from drone_sim.config.types import (
    Checked,
    File,
    Finite,
    ParameterError,
    Switch,
    Within,
    named_in,
    one_of,
    read_yaml,
    readable_key,
)
from drone_sim.files.resources import resolve
from drone_sim.mechanics.object_tree import DEEPEST
from drone_sim.scene import attached_scripts
from drone_sim.scene.attached_scripts import AttachedScripts
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.object_parameters import SHAPES
from drone_sim.wording import shown

MAX_OBJECTS = 1000
WORLD = ("time_step", "sub_step", "gravity")  # what a scene file may say of these comes before the parameters
BESIDE = ("drone", "vehicles", "weather", *WORLD)  # what a scene file holds besides the scene


class FloorParameters(Checked):
    """A square floor at z = 0, centred on the origin; around it is ground, or nothing where `edge` is true."""

    size: Annotated[Finite, Within(0.01, 1e4)]
    texture: File
    edge: Switch


if TYPE_CHECKING:
    _Object = EntryParameters
else:
    _Object = one_of(*SHAPES, *KINDS, key="shape", or_key="kind")


class SceneParameters(Checked):
    """The world without the drone."""

    datum: DatumParameters
    magnetic_field: MagneticField
    floor: FloorParameters
    objects: Annotated[list[_Object], Field(max_length=MAX_OBJECTS)]
    scripts: AttachedScripts

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several objects at once."""
        entries = {}
        for index, one in enumerate(self.objects):
            if one.name and one.name in entries:
                raise _refused(index, "name", one.name, "comes twice")
            entries[one.name] = index, one
        for index, one in enumerate(self.objects):
            above = _above(one, entries)
            if one.name in above:
                raise _refused(index, "parent", one.parent, f"'{one.name}' would be its own ancestor")
            if len(above) > DEEPEST:
                raise _refused(index, "parent", one.parent, f"more than {DEEPEST} objects above '{one.name}'")
        attached_scripts.check(self.scripts)


def _refused(index: int, key: str, value: str, why: str) -> ParameterError:
    return ParameterError(f"parameter scene/objects/{index}/{key} = '{value}': {why}", ("scene", "objects", index, key))


def _above(one: EntryParameters, entries: Mapping[str, tuple[int, EntryParameters]]) -> dict[str, None]:
    """Return the names of the entries that one hangs on, by way of others, too; its own where it does."""
    above: dict[str, None] = {}
    name = one.parent
    while name and name in entries and name not in above:
        above[name] = None
        name = entries[name][1].parent
    return above


def read(file: str) -> dict[str, Any]:
    """Return a scene file's floor, objects, drone and weather as they stand among the parameters.

    Its own files (mesh, urdf, texture) are relative to it. Raises ParameterError.
    """
    try:
        path = resolve(file)
    except FileNotFoundError as error:
        raise ParameterError(f"parameter scene_file = {shown(file)}: {error}") from None
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


def problem_in_file(problem: Problem) -> Problem | None:
    """Return a problem as the scene file has it, where they stand beside the drone; None for any other."""
    if problem.location[:1] in [(key,) for key in BESIDE]:
        return problem
    if problem.location[:1] != ("scene",):
        return None
    location, text = problem.location[1:], problem.text.replace("parameter scene/", "parameter ", 1)
    if len(location) == 1 and "unknown key" in text:
        known = ", ".join(sorted([*SceneParameters.model_fields, *BESIDE]))
        text = f"unknown key {readable_key(location)}; known are {known}"
    return problem._replace(location=location, text=text)


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
