"""Files of a scene: models (a subtree of objects), generated meshes, and entries as scene files have them."""

from __future__ import annotations

import contextlib
import hashlib
import shutil
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drone_sim.config.types import Checked, FoundFile, ParameterError, read_yaml
from drone_sim.files import mesh_files, writing
from drone_sim.files.containment import remove
from drone_sim.files.resources import MEBIBYTE, cache_path
from drone_sim.files.yaml_writing import dump
from drone_sim.scene import scene_parameters
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

_HEAD = "# A model, written by saveModel: metres, radians.\n"
_FILE_KEYS = ("file", "texture", "script", "customization")
_FIRST_KEYS, _PLACE_KEYS = ("name", "alias", "shape", "kind", "type"), ("model", "parent", "position", "rpy")
_MAX_MESHES, _MAX_MESH_BYTES = 1000, 256 * MEBIBYTE  # of the cache of generated meshes


def mesh_file(vertices: Sequence[float], indices: Sequence[int], used: Collection[str]) -> str:
    """Return an STL file of triangles, given by vertices (m) and the indices (from 0) of each triangle's corners.

    The file is named by its content. To make room, the least recently used files that are not in `used` are deleted.
    """
    points = np.reshape(np.asarray(vertices, float), (-1, 3))
    corners = np.reshape(np.asarray(indices, int), (-1, 3))
    if corners.min() < 0 or corners.max() >= len(points):
        raise ValueError(f"indices: each must be from 0 to {len(points) - 1}, the vertices")
    content = mesh_files.stl(points[corners])
    path = _mesh_folder() / f"{hashlib.sha256(content).hexdigest()[:16]}.stl"
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


def _mesh_folder() -> Path:
    """Return the folder of generated meshes, all of which may be deleted when no simulation runs."""
    return cache_path() / "meshes"


def _make_room(files: Iterable[Path], used: Collection[str]) -> None:
    entries = []
    for file in files:
        with contextlib.suppress(FileNotFoundError):  # another process may delete files, too
            entries.append((file.stat(), file))
    size = 0
    for count, (stat, file) in enumerate(sorted(entries, key=lambda entry: -entry[0].st_mtime_ns)):
        size += stat.st_size
        if (count >= _MAX_MESHES or size > _MAX_MESH_BYTES) and str(file) not in used:
            remove(file, within=_mesh_folder())


def plain(values: Checked, folder: Path | None) -> dict[str, Any]:
    """Return values as in YAML, without defaults, with file names for a scene file in `folder` (None: any folder).

    Generated meshes are copied to the folder `meshes` beside the scene file. Raises OSError.
    """
    content = values.model_dump(mode="json", exclude_defaults=True)
    for key in _FILE_KEYS:
        if content.get(key):
            content[key] = file_name(getattr(values, key), folder)
    if "parts" in content:  # a compound
        content["parts"] = [plain(part, folder) for part in getattr(values, "parts")]  # noqa: B009
    return content


def in_order(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the YAML keys of an object in the usual order: names and type, dimensions, pose, and the others."""
    dimensions = [key for key in ("size", "file", "width", "height", "fov") if key in content]
    keys = dict.fromkeys([*_FIRST_KEYS, *dimensions, *_PLACE_KEYS, *content])
    parts = {"parts": [in_order(part) for part in content["parts"]]} if "parts" in content else {}
    return {**{key: content[key] for key in keys if key in content}, **parts}


def file_name(value: Any, folder: Path | None) -> Any:
    """Return a file's name for a scene file in `folder`; any other value unchanged. Raises OSError."""
    if folder is not None and isinstance(value, FoundFile) and Path(value).parent == _mesh_folder():
        copy = folder / "meshes" / Path(value).name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(value, copy)
        return f"meshes/{copy.name}"
    return value.seen_from(folder) if isinstance(value, FoundFile) else value


def write(path: Path, entries: Sequence[EntryParameters], scripts: Sequence[AttachedScriptParameters]) -> None:
    """Write entries and their scripts to a model file; of existing files, only a saved model may be overwritten.

    Raises ParameterError with a message of one line if it cannot be written.
    """
    if path.exists() and not (path.is_file() and path.read_bytes().startswith(_HEAD.encode())):
        raise ParameterError(f"{path}: is not overwritten, because it is not a model that drone_sim saved")
    sections = {"objects": entries, "scripts": scripts}
    try:
        content = {key: [plain(item, path.parent) for item in items] for key, items in sections.items() if items}
        writing.write(path, _HEAD + dump(content, "compact"))
    except OSError as error:
        raise ParameterError(f"{path}: cannot be written ({error.strerror or error})") from None


class Model(NamedTuple):
    """Content of a file, with file names relative to it: objects (at least one) and their scripts."""

    objects: list[dict[str, Any]]
    scripts: list[dict[str, Any]]

    def checked(self) -> tuple[list[EntryParameters], list[AttachedScriptParameters]]:
        """Return entries and scripts; unnamed shapes get names. Raises ParameterError."""
        entries = [scene_parameters.entry_from(values) for values in self.objects]
        scene_parameters.name_shapes(entries)
        return entries, [scene_parameters.script_from(values) for values in self.scripts]


def read(path: Path, imported: Callable[[Path], Path]) -> Model:
    """Return the content of a scene file or model; `imported` converts a V-REP file. Raises ValueError."""
    is_yaml = path.suffix == ".yaml"
    try:
        file = path if is_yaml else imported(path)
    except OSError as error:
        raise ParameterError(f"{path}: {error.strerror or error}") from None
    content = scene_parameters.from_content(read_yaml(file), file.parent)
    if not is_yaml and content.get("vehicles"):
        raise ParameterError(f"{path}: contains a quadricopter: add it with the parameter `vehicles`")
    objects, scripts = content["scene"].get("objects"), content["scene"].get("scripts", [])
    for name, items in (("objects", objects), ("scripts", scripts)):
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise ParameterError(f"{path}: must have a list of `{name}`")
    if not objects:
        raise ParameterError(f"{path}: its list of `objects` is empty")
    return Model(objects, scripts)


def inside(folder: Path | None, name: str, *suffixes: str) -> Path:
    """Return the path of a .yaml file, or one with another allowed suffix, in `folder`. Raises ValueError otherwise."""
    if folder is None:
        raise ValueError(
            f"'{name[:80]}': a model must be in the folder of the scene file, but the simulation has no scene file"
        )
    path = (folder / name).resolve()
    if path.suffix not in (".yaml", *suffixes) or not path.is_relative_to(folder.resolve()):
        allowed = " or ".join((".yaml", *suffixes))
        raise ValueError(f"'{name[:80]}': must be the name of a {allowed} file in the folder of the scene file")
    return path
