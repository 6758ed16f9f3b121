"""Opening and saving of scene files and models, and the scene as text."""

from __future__ import annotations

from pathlib import Path

from drone_sim.config.types import ParameterError
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import locate, package_path
from drone_sim.files.yaml_writing import YamlText
from drone_sim.message_text import shown
from drone_sim.run.scene_document import SceneContent, home, settings_of
from drone_sim.run.simulation import Simulation

_LONGEST_NAME = 100  # characters, without the folder
_NEW = "# Metres, radians, kilograms.\nfloor: {size: 5}\nvehicles: {}\nobjects: []\n"


class SceneFiles:
    """Opens and saves the scene's files for windows."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation

    @property
    def is_read_only(self) -> bool:
        """Whether the file cannot be written, so that saving makes a copy."""
        file = self._simulation.document.file
        return file is None or _is_read_only(file)

    # ---- text

    def text(self) -> str:
        return self._simulation.document.text(self._simulation.content())

    def content_of(self, text: YamlText) -> SceneContent:
        """Return the content of a text. Raises ParameterError, with the line."""
        values = text.values
        if not text.is_mapping:
            raise ParameterError("line 1: must hold `key: value` lines such as `objects: []`")
        simulation = self._simulation
        parameters = simulation.parameters
        try:
            scene_parameters = parameters.with_content(values, simulation.document.folder).scene
        except ParameterError:  # again with line numbers, which are slow to find
            scene_parameters = parameters.with_content(
                values, simulation.document.folder, yaml_files.YamlLines(text.text)
            ).scene
        tree, entries = simulation.tree, {}
        scene_handles = {tree.handle(entry.name) for entry in simulation.scene.entries.values()}
        for number, entry in enumerate(scene_parameters.objects):
            handle = tree.handle(entry.name) if entry.name in tree else -1
            entries[handle if handle in scene_handles else -2 - number] = entry
        scripts = {script.object: script for script in scene_parameters.scripts}
        return SceneContent(entries, scripts, settings_of(values))

    # ---- files

    def open(self, file: str | None) -> None:
        """Open a scene file or, for None, a new scene: a floor without vehicles. Raises ParameterError."""
        simulation = self._simulation
        if file is not None:
            simulation.load_scene(file)
            return
        simulation.stop()
        simulation.replace_scene(simulation.parameters.with_content(yaml_files.parse(_NEW), home()).in_file(""))
        simulation.document.belong_to(None, home(), _NEW, simulation.object_handles)

    def save(self, name: str | None) -> Path:
        """Write the scene to its file, or to another one, which becomes its file; return it.

        A read-only file is copied. During a run the present state is written, and the scene keeps its file. Raises
        ValueError and OSError.
        """
        path, simulation = self._path(name), self._simulation
        text = simulation.save_scene(path)
        if not simulation.running:
            simulation.operations.folder = path.parent
            simulation.replace_scene(simulation.parameters.in_file(str(path)), rebuild=False)
            simulation.document.belong_to(path, path.parent, text, simulation.object_handles)
        return path

    def save_model(self, handle: int, name: str) -> Path:
        """Write an object and its descendants as a model. Raises ValueError and OSError."""
        operations, tree = self._simulation.operations, self._simulation.tree
        path = self._path(name)
        if self._simulation.vehicle_of(handle) is not None:
            raise ValueError(f"'{tree[handle].name}' is part of a vehicle, which cannot be saved as a model")
        members = [member for member in operations.model(handle) if self._simulation.vehicle_of(member) is None]
        path.parent.mkdir(parents=True, exist_ok=True)
        operations.write_model(members, path)
        return path

    def _path(self, name: str | None) -> Path:
        if name is not None:
            path = locate(name)
            if not name.isprintable() or len(path.name) > _LONGEST_NAME or path.suffix not in (".yaml", ".yml"):
                required = f"must end in .yaml, and have at most {_LONGEST_NAME} printable characters"
                raise ParameterError(f"file = {shown(name)}: the name of a scene or model {required}")
            if not path.is_absolute():
                path = self._simulation.document.folder / path
            if _is_read_only(path):
                raise ParameterError(f"{name[:80]}: files of the package cannot be overwritten: give another name")
            return path.resolve()
        file = self._simulation.document.file
        if file is not None and not _is_read_only(file):
            return file
        return home() / (file.name if file else "scene.yaml")


def _is_read_only(path: Path) -> bool:
    """Return whether a file belongs to the package or cannot be written."""
    if package_path() in path.resolve().parents:
        return True
    if not path.exists():
        return False
    try:
        writing.check_writable(path)
    except OSError:
        return True
    return False
