"""Models to add: those of the package by their names, and files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from drone_sim.config.types import FoundFile, named_in
from drone_sim.files.resources import locate, package_path
from drone_sim.message_text import near_names
from drone_sim.scene.models import Model, read

MODELS = "config/models"
_MESHES = (".obj", ".stl", ".dae")
KINDS = (".yaml", ".ttm", ".urdf", *_MESHES)


def package_models() -> dict[str, Path]:
    """Return the files of the models that come with the package, by name."""
    return {one.stem: one for one in sorted((package_path() / MODELS).glob("*.yaml"))}


def _in_package(file: FoundFile) -> FoundFile:
    """Return a file of a model as any scene, on any machine, can name it."""
    return named_in(Path(), f"package://drone_sim/{MODELS}/{file.given}")


def model_said(name: str, folder: Path, imported: Callable[[Path], Path]) -> Model:
    """Return what a scene file would say of a model: one of the package's by name, or a file, seen from `folder`.

    `imported` makes a scene file of one of V-REP's. Raises ValueError, and OSError.
    """
    suffix = Path(name).suffix.lower()
    if not suffix:
        known = package_models()
        if name not in known:
            raise ValueError(f"no model named '{name}'; {near_names(name, known)}")
        model = read(known[name], imported)
        for one in model.objects:
            one.update({key: _in_package(one[key]) for key in ("file", "texture") if key in one})
        return model
    if suffix not in KINDS:
        raise ValueError(f"{name[:80]}: a model is a {', '.join(KINDS[:-1])} or {KINDS[-1]} file")
    file = named_in(folder, name)
    if suffix in (".yaml", ".ttm"):
        return read(locate(file), imported)
    said = {"shape": "mesh" if suffix in _MESHES else "urdf", "file": file, "name": Path(name).stem[:60]}
    return Model([said], [])
