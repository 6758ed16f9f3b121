"""Where a window opens and saves scenes and models, and the scene as a text beside it."""

from __future__ import annotations

from pathlib import Path

from drone_sim.config.types import ParameterError
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import locate, package_path
from drone_sim.files.yaml_text import YamlText
from drone_sim.run.scene_document import SceneContent, home
from drone_sim.run.scene_settings import settings_of
from drone_sim.scene import models
from drone_sim.scene.entry import placed

_NEW = "# Metres, radians, kilograms.\nfloor: {size: 5}\nvehicles: {}\nobjects: []\n"


class SceneFiles:
    """Names a window's files; what is in them is written as by any program."""

    def __init__(self, scene: SceneAccess):
        """Take the scene."""
        self._scene = scene

    @property
    def is_read_only(self) -> bool:
        """Whether saving makes a copy of the file."""
        file = self._scene.document.file
        return file is None or _is_kept(file)

    # ---- as a text

    def text(self) -> str:
        """Return what the file would say of the scene as it is now."""
        return self._scene.document.text(self._scene.content())

    def content_of(self, text: YamlText) -> SceneContent:
        """Return the scene that a text says. Raises ParameterError, with the line."""
        said = text.values
        if not text.is_mapping:
            raise ParameterError("line 1: must hold `key: value` lines such as `objects: []`")
        scene = self._scene
        parameters = scene.simulation.parameters
        try:
            found = parameters.with_content(said, scene.folder).scene
        except ParameterError:  # once more, with the lines, which take their time
            found = parameters.with_content(said, scene.folder, yaml_files.YamlLines(text.text)).scene
        tree, entries = scene.tree, {}
        own = {tree.handle(one.name) for one in scene.simulation.scene.entries.values()}
        for number, one in enumerate(found.objects):
            handle = tree.handle(one.name) if one.name in tree else -1
            entries[handle if handle in own else -2 - number] = one
        scripts = {one.object: one for one in found.scripts}
        return SceneContent(entries, scripts, settings_of(said))

    # ---- files

    def open(self, file: str | None) -> None:
        """Let a file take the scene's place, or, for None, a floor where nobody flies. Raises ParameterError."""
        simulation = self._scene.simulation
        if file is not None:
            simulation.load_scene(file)
            return
        simulation.stop()
        simulation.arrange(simulation.parameters.with_content(yaml_files.parse(_NEW), home()).in_file(""))
        simulation.document.belong_to(None, home(), _NEW, simulation.object_handles)

    def save(self, name: str | None) -> Path:
        """Write the scene's file, or another, which is its file then; return it. Raises ValueError and OSError.

        One that nobody may write to is copied. What flies is written as it stands; the scene's file stays the same.
        """
        path, simulation = self._path(name), self._scene.simulation
        text = simulation.save_scene(path)
        if not simulation.running:
            simulation.operations.folder = path.parent
            simulation.arrange(simulation.parameters.in_file(str(path)), rebuild=False)
            simulation.document.belong_to(path, path.parent, text, simulation.object_handles)
        return path

    def save_model(self, handle: int, name: str) -> Path:
        """Write an object and all that hangs on it as a model. Raises ValueError and OSError."""
        operations, tree = self._scene.operations, self._scene.tree
        path = self._path(name)
        scripts = self._scene.simulation.scene.scripts
        entries = [operations.entry(one) for one in operations.model(handle) if self._scene.vehicle_of(one) is None]
        if not entries:
            raise ValueError(f"'{tree[handle].name}' is part of a vehicle, which is no model of the scene")
        base = placed(entries[0], "", tree.matrix(handle))
        path.parent.mkdir(parents=True, exist_ok=True)
        models.write(path, [base, *entries[1:]], [scripts[one.name] for one in entries if one.name in scripts])
        return path

    def _path(self, name: str | None) -> Path:
        if name is not None:
            path = locate(name)
            if path.suffix not in (".yaml", ".yml"):
                raise ParameterError(f"{name[:80]}: the name of a scene must end in .yaml")
            if not path.is_absolute():
                path = self._scene.folder / path
            if _is_kept(path):
                raise ParameterError(f"{name[:80]}: files of the package cannot be overwritten: give another name")
            return path.resolve()
        file = self._scene.document.file
        if file is not None and not _is_kept(file):
            return file
        return home() / (file.name if file else "scene.yaml")


def _is_kept(path: Path) -> bool:
    """Tell whether a file is one of the package's, or must not be written to."""
    return package_path() in path.resolve().parents or (path.exists() and not _may_write(path))


def _may_write(path: Path) -> bool:
    try:
        writing.check(path)
    except OSError:
        return False
    return True
