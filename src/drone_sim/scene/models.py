"""Several objects as one: rigid compounds of shapes; models, which are a part of the tree in a file; meshes' files."""

from __future__ import annotations

import contextlib
import hashlib
import shutil
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drone_sim.config.types import Checked, FoundFile, ParameterError, read_yaml
from drone_sim.files import mesh_files, writing, yaml_files
from drone_sim.files.containment import remove
from drone_sim.files.resources import MEBIBYTE, cache_path
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.scene import scene_parameters
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters, place_at
from drone_sim.scene.object_parameters import CompoundParameters, ObjectParameters, PartParameters
from drone_sim.shapes import SCENE_SHAPES
from drone_sim.shapes.compound import parts_of
from drone_sim.shapes.shape import DrawnShape

_HEAD = "# A model, written by saveModel: metres, radians.\n"
_FILES = ("file", "texture", "script")
_FIRST, _PLACE = ("name", "alias", "shape", "kind", "type"), ("model", "parent", "position", "rpy")
_MOST_MESHES, _MOST_BYTES = 1000, 256 * MEBIBYTE  # of made meshes that are kept


# ---- compounds


def grouped(entries: Sequence[EntryParameters], frames_of: Sequence[Matrix]) -> dict[str, Any]:
    """Return what a scene file says of one shape of several, in the frame of the first. Raises ValueError."""
    parts, mass = [], 0.0
    for one, matrix in zip(entries, frames_of):
        if not isinstance(one, ObjectParameters) or one.shape == "urdf":
            raise ValueError(f"'{one.name}' is not a shape that can be grouped")
        local = frames.relative(frames_of[0], matrix)
        members = one.parts if isinstance(one, CompoundParameters) else [one]
        for member in members:
            own = local if member is one else frames.multiply(local, frames.from_rpy(member.position, member.rpy))
            parts.append({**_look(member), **_place(own)})
        mass += one.mass
    first = entries[0]
    assert isinstance(first, ObjectParameters), "checked above"
    kept = {
        key: getattr(first, key) for key in ("parent", "position", "rpy", "alias", "static", "respondable", "visible")
    }
    return {**kept, "shape": "compound", "mass": mass, "parts": parts}


def parted(entry: EntryParameters, matrix: Matrix) -> list[dict[str, Any]]:
    """Return what a scene file says of the parts of a shape, each alone in the world. Raises ValueError."""
    if not isinstance(entry, CompoundParameters):
        raise ValueError(f"'{entry.name}' is not a compound")
    volumes = [_volume(one) for one in entry.parts]
    kept = {key: getattr(entry, key) for key in ("static", "respondable", "visible")}
    return [
        {
            **kept,
            **_look(one),
            **_place(frames.multiply(matrix, frames.from_rpy(one.position, one.rpy))),
            "mass": entry.mass * volume / sum(volumes),
        }
        for one, volume in zip(entry.parts, volumes)
    ]


def _look(said: ObjectParameters | PartParameters) -> dict[str, Any]:
    keys = [field.name for field in fields(SCENE_SHAPES[said.shape])]
    return {"shape": said.shape, "color": said.color, **{key: getattr(said, key) for key in keys}}


def _place(matrix: Matrix) -> dict[str, Any]:
    return {key: value for key, value in place_at(matrix, "").items() if key != "parent"}


def _volume(part: PartParameters) -> float:
    shape = part.part.shape
    return shape.solid().volume if isinstance(shape, DrawnShape) else 0.0


def bounds(entry: EntryParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner (m) of a shape in its own frame. Raises ValueError for what is none."""
    if not isinstance(entry, ObjectParameters) or entry.shape == "urdf":
        raise ValueError(f"'{entry.name}' has no bounding box of its own")
    corners = []
    for shape, local, _ in parts_of(entry.to_shape(), entry.color):
        assert isinstance(shape, DrawnShape), "what is no urdf is drawn"
        turn = np.reshape(local, (3, 4))
        for part in shape.triangles():
            corners.append(part.corners.reshape(-1, 3) @ turn[:, :3].T + turn[:, 3])
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)


# ---- files


def mesh_file(vertices: Sequence[float], indices: Sequence[int], used: Collection[str]) -> str:
    """Return a file with triangles: their corners' coordinates (m), and the corners of each, from 0.

    It is named by its content. The least recently used files that are not among `used` are deleted to make room for it.
    """
    points = np.reshape(np.asarray(vertices, float), (-1, 3))
    corners = np.reshape(np.asarray(indices, int), (-1, 3))
    if corners.min() < 0 or corners.max() >= len(points):
        raise ValueError(f"indices: each must be from 0 to {len(points) - 1}, the vertices")
    content = mesh_files.stl(points[corners])
    path = _made_meshes() / f"{hashlib.sha256(content).hexdigest()[:16]}.stl"
    try:
        if path.is_file():
            path.touch()
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            with writing.replacing(path, binary=True) as file:
                file.write(content)
            _make_room(path.parent.glob("*.stl"), {str(path), *used})
    except OSError as error:
        raise ParameterError(f"{path}: cannot be written ({error.strerror or error})") from None
    return str(path)


def _made_meshes() -> Path:
    """Return the folder of meshes that were made, any of which may be deleted when no simulation runs."""
    return cache_path() / "meshes"


def _make_room(files: Iterable[Path], used: Collection[str]) -> None:
    found = []
    for one in files:
        with contextlib.suppress(FileNotFoundError):  # another process makes room, too
            found.append((one.stat(), one))
    size = 0
    for count, (stat, one) in enumerate(sorted(found, key=lambda pair: -pair[0].st_mtime_ns)):
        size += stat.st_size
        if (count >= _MOST_MESHES or size > _MOST_BYTES) and str(one) not in used:
            remove(one, within=_made_meshes())


def plain(values: Checked, folder: Path | None) -> dict[str, Any]:
    """Return values as YAML has them, without defaults; their files named as a scene file in `folder` can name them.

    None is any folder. Meshes that were made are copied beside the file. Raises OSError.
    """
    said = values.model_dump(mode="json", exclude_defaults=True)
    for key in _FILES:
        if said.get(key):
            said[key] = file_name(getattr(values, key), folder)
    if "parts" in said:  # of a compound
        said["parts"] = [plain(one, folder) for one in getattr(values, "parts")]  # noqa: B009
    return said


def in_order(said: Mapping[str, Any]) -> dict[str, Any]:
    """Return what YAML says of an object in the order in which a person writes it: what it is, where, and the rest."""
    own = [key for key in ("size", "file", "width", "height", "fov") if key in said]
    keys = dict.fromkeys([*_FIRST, *own, *_PLACE, *said])
    parts = {"parts": [in_order(one) for one in said["parts"]]} if "parts" in said else {}
    return {**{key: said[key] for key in keys if key in said}, **parts}


def file_name(value: Any, folder: Path | None) -> Any:
    """Return a file's name as a scene file in `folder` can name it; what is none, as it is. Raises OSError."""
    if folder is not None and isinstance(value, FoundFile) and Path(value).parent == _made_meshes():
        kept = folder / "meshes" / Path(value).name
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(value, kept)
        return f"meshes/{kept.name}"
    return value.seen_from(folder) if isinstance(value, FoundFile) else value


def write(path: Path, entries: Sequence[EntryParameters], scripts: Sequence[AttachedScriptParameters]) -> None:
    """Write entries and the scripts on them as a file; only a model that was saved here may be overwritten.

    Raises ValueError, in one line, where it cannot be.
    """
    if path.exists() and not (path.is_file() and path.read_bytes().startswith(_HEAD.encode())):
        raise ParameterError(f"{path}: is not overwritten, because it is not a model that drone_sim saved")
    listed = {"objects": entries, "scripts": scripts}
    try:
        content = {key: [plain(one, path.parent) for one in several] for key, several in listed.items() if several}
        text = _HEAD + yaml_files.dump(content, default_flow_style=None, width=120)
        writing.write(path, text)
    except OSError as error:
        raise ParameterError(f"{path}: cannot be written ({error.strerror or error})") from None


class Model(NamedTuple):
    """What a file says, its own files relative to it: objects, of which there is one at least, and scripts on them."""

    objects: list[dict[str, Any]]
    scripts: list[dict[str, Any]]


def read(path: Path, imported: Callable[[Path], Path]) -> Model:
    """Return what a scene file or a model says; `imported` makes a scene file of one of V-REP's. Raises ValueError."""
    is_own = path.suffix == ".yaml"
    try:
        file = path if is_own else imported(path)
    except OSError as error:
        raise ParameterError(f"{path}: {error.strerror or error}") from None
    said = scene_parameters.from_content(read_yaml(file), file.parent)
    if not is_own and said.get("vehicles"):
        raise ParameterError(f"{path}: is a quadricopter: add it with the parameter `vehicles`")
    objects, scripts = said["scene"].get("objects"), said["scene"].get("scripts", [])
    for name, several in (("objects", objects), ("scripts", scripts)):
        if not isinstance(several, list) or not all(isinstance(one, dict) for one in several):
            raise ParameterError(f"{path}: must have a list of `{name}`")
    if not objects:
        raise ParameterError(f"{path}: its list of `objects` is empty")
    return Model(objects, scripts)


def inside(folder: Path | None, name: str, *suffixes: str) -> Path:
    """Return a file in a folder, with .yaml or another suffix. Raises ValueError for what is none."""
    if folder is None:
        raise ValueError(
            f"'{name[:80]}': a model must be in the folder of the scene file, but the simulation has no scene file"
        )
    path = (folder / name).resolve()
    if path.suffix not in (".yaml", *suffixes) or not path.is_relative_to(folder.resolve()):
        known = " or ".join((".yaml", *suffixes))
        raise ValueError(f"'{name[:80]}': must be the name of a {known} file in the folder of the scene file")
    return path
