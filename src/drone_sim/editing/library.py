"""Models that can be added: the package's models by name, and files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from drone_sim.config.types import named_in
from drone_sim.files.resources import locate, package_path
from drone_sim.message_text import near_names
from drone_sim.scene.models import Model, read

_MODELS = "config/models"
_MESHES = (".obj", ".stl", ".dae")
KINDS = (".yaml", ".ttm", ".urdf", *_MESHES)


def read_model_file(name: str, folder: Path, imported: Callable[[Path], Path]) -> Model:
    """Return the content of a model: a model of the package by name, or a file relative to `folder`.

    `imported` converts a V-REP file to a scene file. Raises ValueError and OSError.
    """
    suffix = Path(name).suffix.lower()
    if not suffix:
        available = {file.stem: file for file in sorted((package_path() / _MODELS).glob("*.yaml"))}
        if name not in available:
            raise ValueError(f"no model named '{name}'; {near_names(name, available)}")
        model = read(available[name], imported)
        for entry in model.objects:
            for key in ("file", "texture"):
                if key in entry:  # a name that is valid for any scene on any machine
                    entry[key] = named_in(Path(), f"package://drone_sim/{_MODELS}/{entry[key].given}")
        return model
    if suffix not in KINDS:
        raise ValueError(f"{name[:80]}: a model is a {', '.join(KINDS[:-1])} or {KINDS[-1]} file")
    file = named_in(folder, name)
    if suffix in (".yaml", ".ttm"):
        return read(locate(file), imported)
    entry_values = {"shape": "mesh" if suffix in _MESHES else "urdf", "file": file, "name": Path(name).stem[:60]}
    return Model([entry_values], [])
