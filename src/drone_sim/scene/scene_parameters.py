"""What a scene file may say: floor, objects, and where the drone stands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_sim.config.errors import Problem
from drone_sim.config.types import (
    Angles,
    Checked,
    Color,
    File,
    Finite,
    Label,
    Length,
    Mass,
    OptionalFile,
    ParameterError,
    Point,
    Switch,
    Within,
    named_in,
    read_yaml,
    readable_key,
)
from drone_sim.files.resources import resolve
from drone_sim.wording import shown

MAX_OBJECTS = 1000
_BESIDE = ("drone", "vehicles")  # what a scene file holds besides the scene
_Scale = Annotated[Finite, Within(1e-6, 1e6)]


class FloorParameters(Checked):
    """A square floor at z = 0, centred on the origin; around it is ground, or nothing where `edge` is true."""

    size: Annotated[Finite, Within(0.01, 1e4)]
    texture: File
    edge: Switch


class _ObjectParameters(Checked):
    """What the objects of a scene have in common; a mass of 0 stands still."""

    name: Label = ""
    position: Point
    rpy: Angles = (0.0, 0.0, 0.0)
    mass: Mass = 0.0
    color: Color = (0.7, 0.7, 0.7, 1.0)
    texture: OptionalFile = ""


class BoxParameters(_ObjectParameters):
    """A box; `size` is its full length, width and height."""

    shape: Literal["box"]
    size: Annotated[tuple[Length, Length, Length], Field(description="3 numbers, [length, width, height] in m")]


class CylinderParameters(_ObjectParameters):
    """A cylinder along its z axis; `size` is radius and length."""

    shape: Literal["cylinder"]
    size: Annotated[tuple[Length, Length], Field(description="2 numbers, [radius, length] in m")]


class SphereParameters(_ObjectParameters):
    """A sphere; `size` is its radius."""

    shape: Literal["sphere"]
    size: Annotated[tuple[Length], Field(description="a list of 1 number, [radius] in m")]


class MeshParameters(_ObjectParameters):
    """A mesh file (OBJ, STL, COLLADA); `size` is its scale along x, y and z."""

    shape: Literal["mesh"]
    file: File
    size: Annotated[tuple[_Scale, _Scale, _Scale], Field(description="3 numbers, its scale along [x, y, z]")] = (
        1,
        1,
        1,
    )
    color: Color = (1.0, 1.0, 1.0, 1.0)


class UrdfParameters(_ObjectParameters):
    """A URDF, which says itself how it looks; a mass of 0 nails its root link to the world."""

    shape: Literal["urdf"]
    file: File
    size: tuple[()] = ()


ObjectParameters = Annotated[
    BoxParameters | CylinderParameters | SphereParameters | MeshParameters | UrdfParameters,
    Field(discriminator="shape"),
]


class SceneParameters(Checked):
    """The world without the drone."""

    floor: FloorParameters
    objects: Annotated[list[ObjectParameters], Field(max_length=MAX_OBJECTS)]

    def model_post_init(self, _context: Any) -> None:
        """Check what concerns several objects at once."""
        names = set()
        for index, one in enumerate(self.objects):
            if one.name and one.name in names:
                location = ("scene", "objects", index, "name")
                raise ParameterError(f"parameter scene/objects/{index}/name = '{one.name}': comes twice", location)
            names.add(one.name)


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
    places = [scene.get("floor"), *_listed(scene.get("objects"))] if isinstance(scene, dict) else []
    vehicles = values.get("vehicles")
    entries = vehicles.values() if isinstance(vehicles, dict) else ()
    for place in (values.get("drone"), *places, *entries):
        _find_beside(folder, place)


def problem_in_file(problem: Problem) -> Problem | None:
    """Return a problem as the scene file has it, where floor and objects stand beside the drone; None for any other."""
    if problem.location[:1] in (("drone",), ("vehicles",)):
        return problem
    if problem.location[:1] != ("scene",):
        return None
    location, text = problem.location[1:], problem.text.replace("parameter scene/", "parameter ", 1)
    if len(location) == 1 and "unknown key" in text:
        text = f"unknown key {readable_key(location)}; known are drone, floor, objects, vehicles"
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
