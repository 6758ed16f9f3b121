"""What a scene file may say: floor, objects, and where the drone stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from pydantic import Field, create_model

from drone_sim.config.errors import Problem
from drone_sim.config.place import DatumParameters, MagneticField
from drone_sim.config.types import (
    Angles,
    Checked,
    Color,
    File,
    Finite,
    Label,
    Mass,
    OptionalFile,
    ParameterError,
    Point,
    Switch,
    Within,
    named_in,
    one_of,
    read_yaml,
    readable_key,
)
from drone_sim.files.resources import resolve
from drone_sim.mechanics.frames import from_rpy, to_quaternion
from drone_sim.mechanics.state import Pose
from drone_sim.scene import attached_scripts
from drone_sim.scene.attached_scripts import AttachedScripts
from drone_sim.shapes import SCENE_SHAPES
from drone_sim.shapes.shape import SceneShape
from drone_sim.wording import shown

MAX_OBJECTS = 1000
_BESIDE = ("drone", "vehicles")  # what a scene file holds besides the scene


class FloorParameters(Checked):
    """A square floor at z = 0, centred on the origin; around it is ground, or nothing where `edge` is true."""

    size: Annotated[Finite, Within(0.01, 1e4)]
    texture: File
    edge: Switch


class ObjectParameters(Checked):
    """An object of the scene: what all have in common; each shape brings its own keys. A mass of 0 stands still."""

    name: Label = ""
    position: Point
    rpy: Angles = (0.0, 0.0, 0.0)
    mass: Mass = 0.0
    color: Color
    texture: OptionalFile = ""
    shape: str

    @property
    def pose(self) -> Pose:
        """Where it stands."""
        x, y, z = self.position
        return Pose((x, y, z), to_quaternion(from_rpy((0, 0, 0), self.rpy)))

    def to_shape(self) -> SceneShape:
        """Return its shape, of the keys that this brings."""
        shape = SCENE_SHAPES[self.shape]
        return shape(**{field.name: getattr(self, field.name) for field in fields(shape)})


def _with_keys_of(shape: type[SceneShape]) -> type[ObjectParameters]:
    """Return what a scene file may say of an object of this shape."""
    keys: dict[str, Any] = {"color": (Color, shape.default_color), "shape": (Literal[shape.word], ...)}
    types = get_type_hints(shape, include_extras=True)
    for field in fields(shape):
        keys[field.name] = (types[field.name], ... if field.default is MISSING else field.default)
    return create_model(f"{shape.__name__}Parameters", __base__=ObjectParameters, **keys)


if TYPE_CHECKING:
    _Object = ObjectParameters
else:
    _Object = one_of(*map(_with_keys_of, SCENE_SHAPES.values()), key="shape")


class SceneParameters(Checked):
    """The world without the drone."""

    datum: DatumParameters
    magnetic_field: MagneticField
    floor: FloorParameters
    objects: Annotated[list[_Object], Field(max_length=MAX_OBJECTS)]
    scripts: AttachedScripts

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several objects at once."""
        names = set()
        for index, one in enumerate(self.objects):
            if one.name and one.name in names:
                location = ("scene", "objects", index, "name")
                raise ParameterError(f"parameter scene/objects/{index}/name = '{one.name}': comes twice", location)
            names.add(one.name)
        attached_scripts.check(self.scripts)


def read(file: str) -> dict[str, Any]:
    """Return a scene file's floor, objects and drone as they stand among the parameters.

    Its own files (mesh, urdf, texture) are relative to it. Raises ParameterError.
    """
    try:
        path = resolve(file)
    except FileNotFoundError as error:
        raise ParameterError(f"parameter scene_file = {shown(file)}: {error}") from None
    return from_content(read_yaml(path), path.parent)


def from_content(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return what `read` does, of a scene file's content."""
    scene = {
        key: value for key, value in content.items() if key not in _BESIDE
    }  # the unknown are refused with the rest
    found = {"scene": scene, **{key: content[key] for key in _BESIDE if key in content}}
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
    if problem.location[:1] in (("drone",), ("vehicles",)):
        return problem
    if problem.location[:1] != ("scene",):
        return None
    location, text = problem.location[1:], problem.text.replace("parameter scene/", "parameter ", 1)
    if len(location) == 1 and "unknown key" in text:
        known = ", ".join(sorted([*SceneParameters.model_fields, *_BESIDE]))
        text = f"unknown key {readable_key(location)}; known are {known}"
    return problem._replace(location=location, text=text)


def _listed(objects: Any) -> list[Any]:
    return objects if isinstance(objects, list) else []  # what is no list is refused with the other values


def _find_beside(folder: Path, place: Any) -> None:
    for key in ("file", "texture", "urdf", "script"):
        name = place.get(key) if isinstance(place, dict) else None
        if key == "script" and not Path(str(name)).suffix:  # tutorial and target have none
            continue
        if isinstance(name, str) and name and not hasattr(name, "given"):  # an alias is the same mapping once more
            place[key] = named_in(folder, name)
