"""The scene as a file: its text, which keeps what its author wrote of it, read, written and checked."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import FoundFile, ParameterError
from drone_sim.editing.changes import SceneContent, Settings
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.settings import vehicles_in, with_vehicles
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import cache_path, locate, package_path, resolve
from drone_sim.files.yaml_text import YamlText, dumped, says
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.run.parameters import load
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters, placed

HOME = Path("~/.ros/drone_sim")  # of scenes that were read from where nobody may write
_NEW = "# Metres, radians, kilograms.\nfloor: {size: 5}\nvehicles: {}\nobjects: []\n"
_LISTS = ("objects", "scripts")
_FIRST, _PLACE = ("name", "alias", "shape", "kind", "type"), ("model", "parent", "position", "rpy")


class SceneDocument:
    """The file of the scene, or none, and the text that it was read from."""

    def __init__(self, scene: SceneAccess):
        """Take the scene; `read` is due."""
        self._scene = scene
        self.file: Path | None = None
        self.base = YamlText("")
        self._written: int | None = None  # when the file was written, as the disk says it
        self._entries: list[tuple[int, EntryParameters]] = []  # those of the text, with their handles
        self._scripts: list[AttachedScriptParameters] = []

    @property
    def is_read_only(self) -> bool:
        """Whether saving makes a copy of the file."""
        return self.file is None or _is_kept(self.file)

    # ---- from a file

    def read(self) -> None:
        """Take the file that the simulation has read its scene from."""
        parameters = self._scene.simulation.parameters
        file = parameters.scene_file
        self.file, self._written = (resolve(file) if file else None), None
        self._scene.folder = self.file.parent if self.file else HOME.expanduser()
        if self.file is None:
            self._take("", _settings_of(self._scene))
        else:
            text = self.file.read_text(encoding="utf-8-sig")
            self._take(text, _beside(yaml_files.parse(text)))
        if self.file and cache_path() in self.file.parents:  # made of one of V-REP's
            self.file = None

    def open(self, file: str | None) -> None:
        """Let a file take the scene's place, or, for None, a floor where nobody flies. Raises ParameterError."""
        simulation = self._scene.simulation
        if file is not None:
            simulation.load_scene(file)
            return
        folder = HOME.expanduser()
        content = yaml_files.parse(_NEW)
        simulation.stop()
        simulation.arrange(simulation.parameters.with_content(content, folder).in_file(""))
        self.file, self._written, self._scene.folder = None, None, folder
        self._take(_NEW, _beside(content))

    def _take(self, text: str, settings: Settings) -> None:
        self._scene.settings = settings
        self.take_text(YamlText(text))

    def take_text(self, text: YamlText) -> None:
        """Know that a text says what the scene is now."""
        self.base = text
        scene, tree = self._scene.simulation.scene, self._scene.tree
        said = self.base.values
        now = [(tree.handle(one.name), scene.entry_now(index)) for index, one in scene.entries.items()]
        names = [one.name for one in self._parsed(said)] if said.get("objects") else []
        by_name = {one.name: (handle, one) for handle, one in now}
        self._entries = [by_name.get(name, (WORLD, now[0][1])) for name in names]
        self._scripts = [*scene.scripts.values()] if said.get("scripts") else []

    def _parsed(self, said: Any) -> list[EntryParameters]:
        found = scene_parameters.from_content(copy.deepcopy(said), self._scene.folder)
        entries = [scene_parameters.entry_from(one) for one in found["scene"]["objects"]]
        scene_parameters.name_shapes(entries)
        return entries

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
        return SceneContent(entries, scripts, _beside(said))

    # ---- as a text

    def text(self) -> str:
        """Return what its file would say of the scene as it is now."""
        said, kept = self._said(self._scene.folder, self._scene.settings)
        return self.base.rewritten(said, kept)

    def _said(self, folder: Path, settings: Settings) -> tuple[dict[str, Any], dict[str, list[int | None]]]:
        """Return what a file in a folder says of the scene, and which items of its lists the text had."""
        here = self._scene.folder
        now = self._scene.content()
        old = self.base.values
        items: list[Any] = []
        kept: list[int | None] = []
        rest = dict(now.entries)
        for index, (handle, before) in enumerate(self._entries):
            entry = rest.pop(handle, None)
            if entry is not None and type(entry) is type(before):
                items.append(_changed(old["objects"][index], models.plain(before, here), models.plain(entry, folder)))
                kept.append(index)
            elif entry is not None:
                rest[handle] = entry
        new = [_ordered(models.plain(one, folder)) for one in rest.values()]
        new_scripts, kept_scripts = self._script_items(old.get("scripts") or [], now.scripts, folder)
        said: dict[str, Any] = {**_moved_files(settings, here, folder), "objects": [*items, *new]}
        if new_scripts or "scripts" in old:
            said["scripts"] = new_scripts
        ordered = {key: said[key] for key in (*old, *said) if key in said}
        return ordered, {"objects": [*kept, *[None] * len(new)], "scripts": kept_scripts}

    def _script_items(
        self, old: list[Any], now: Mapping[str, AttachedScriptParameters], folder: Path
    ) -> tuple[list[Any], list[int | None]]:
        items, kept, rest = [], [], dict(now)
        for index, before in enumerate(self._scripts[: len(old)]):
            name = old[index].get("object")
            script = rest.pop(name, None)
            if script is not None:
                plain = models.plain(before, self._scene.folder)
                items.append(_changed(old[index], plain, models.plain(script, folder)))
                kept.append(index)
        return [*items, *(models.plain(one, folder) for one in rest.values())], [*kept, *[None] * len(rest)]

    # ---- to a file

    def save(self, name: str | None) -> Path:
        """Write the scene's file, or another, which is its file then; return it. Raises ValueError and OSError.

        One that nobody may write to is copied. What flies is written as it stands; the scene's file stays the same.
        """
        path, flies = self._path(name), self._scene.simulation.running
        said, kept = self._said(path.parent, self._scene.settings_in_flight() if flies else self._scene.settings)
        text = self.base.rewritten(said, kept)
        text = text if says(text, said) else dumped(said)
        simulation = self._scene.simulation
        try:
            simulation.parameters.with_content(yaml_files.parse(text), path.parent)
        except ValueError as error:
            raise ParameterError(f"the scene as it stands cannot be saved: {error}") from None
        path.parent.mkdir(parents=True, exist_ok=True)
        if path != self.file and path.is_file():
            with contextlib.suppress(FileNotFoundError), writing.replacing(f"{path}.bak", binary=True) as before:
                before.write(path.read_bytes())
        writing.write(path, text)
        if flies:
            return path
        self.file = path
        settings = _moved_files(self._scene.settings, self._scene.folder, path.parent)
        self._scene.folder = simulation.operations.folder = path.parent
        simulation.arrange(simulation.parameters.in_file(str(path)), rebuild=False)
        self._take(text, settings)
        self._written = _age(path)
        return path

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether somebody has written the file since this node did."""
        return self.file is not None and self._written is not None and _age(self.file) != self._written

    def _path(self, name: str | None) -> Path:
        if name is not None:
            path = locate(name)
            if path.suffix not in (".yaml", ".yml"):
                raise ParameterError(f"{name[:80]}: a scene is saved as a .yaml file")
            if not path.is_absolute():
                path = self._scene.folder / path
            if _is_kept(path):
                raise ParameterError(f"{name[:80]}: the files of the package stay as they are: give another name")
            return path.resolve()
        if self.file is not None and not _is_kept(self.file):
            return self.file
        return HOME.expanduser() / (self.file.name if self.file else "scene.yaml")

    def save_model(self, handle: int, name: str) -> Path:
        """Write an object and all that hangs on it as a model. Raises ValueError and OSError."""
        operations, tree = self._scene.operations, self._scene.tree
        path = self._path(name)
        scripts = self._scene.simulation.scene.scripts
        entries = [operations.entry(one) for one in operations.model(handle) if self._scene.vehicle_of(one) is None]
        base = placed(entries[0], "", tree.matrix(handle))
        path.parent.mkdir(parents=True, exist_ok=True)
        models.write(path, [base, *entries[1:]], [scripts[one.name] for one in entries if one.name in scripts])
        return path


def _age(path: Path) -> int | None:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _is_kept(path: Path) -> bool:
    """Tell whether a file is one of the package's, or must not be written to."""
    return package_path() in path.resolve().parents or (path.exists() and not _may_write(path))


def _may_write(path: Path) -> bool:
    try:
        writing.check(path)
    except OSError:
        return False
    return True


def _beside(said: Any) -> Settings:
    return {key: value for key, value in (said or {}).items() if key not in _LISTS}


def _settings_of(scene: SceneAccess) -> Settings:
    """Return what a file would say of the scene of the parameters, beside its objects."""
    parameters, default = scene.simulation.parameters, load().scene
    own = parameters.scene
    settings: dict[str, Any] = {}
    for key in ("floor", "datum"):
        if getattr(own, key) != getattr(default, key):
            settings[key] = models.plain(getattr(own, key), scene.folder)
    if own.magnetic_field != default.magnetic_field:
        settings["magnetic_field"] = list(own.magnetic_field)
    return with_vehicles(settings, vehicles_in({}, parameters), parameters)


def _changed(raw: Mapping[str, Any], before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was written of an entry, but for what it says otherwise by now."""
    keys = {key for key in {**before, **now} if before.get(key) != now.get(key)}
    written = {key: value for key, value in raw.items() if key not in keys or key in now}
    return {**written, **{key: now[key] for key in now if key in keys}}


def _ordered(said: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry in the order in which a person writes it: what it is, where, and the rest."""
    own = [key for key in ("size", "file", "width", "height", "fov") if key in said]
    keys = dict.fromkeys([*_FIRST, *own, *_PLACE, *said])
    parts = {"parts": [_ordered(one) for one in said["parts"]]} if "parts" in said else {}
    return {**{key: said[key] for key in keys if key in said}, **parts}


def _moved_files(settings: Settings, here: Path, there: Path) -> dict[str, Any]:
    """Return settings whose files are named as a file in another folder can name them."""
    if here == there:
        return dict(settings)
    found = scene_parameters.from_content(copy.deepcopy(dict(settings)), here)
    inside = found.pop("scene")
    made: dict[str, Any] = _seen_from({**inside, **found}, there)
    return {key: made[key] for key in settings}


def _seen_from(value: Any, folder: Path) -> Any:
    if isinstance(value, Mapping):
        return {key: _seen_from(one, folder) for key, one in value.items()}
    if isinstance(value, list):
        return [_seen_from(one, folder) for one in value]
    return value.seen_from(folder) if isinstance(value, FoundFile) else value
