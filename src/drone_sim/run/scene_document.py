"""The scene file: its text, with the author's comments and order, and the text for the present scene."""

from __future__ import annotations

import contextlib
import copy
import os
from collections.abc import Iterable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from drone_sim.config.types import Checked, ParameterError
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import cache_path, resolve
from drone_sim.files.yaml_writing import YamlText, dump, has_values
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_settings import Settings, settings_of, settings_without_file, with_files_seen_from
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

_Handles = Mapping[str, int]  # by object name
_Key = TypeVar("_Key", int, str)


def home() -> Path:
    """Return the folder for scenes without a file, or whose folder is not writable."""
    return Path(os.path.expanduser("~/.ros/drone_sim"))


class SceneContent(NamedTuple):
    """Content of a scene: entries by object handle, scripts by object name, and settings."""

    entries: Mapping[int, EntryParameters]
    scripts: Mapping[str, AttachedScriptParameters]
    settings: Settings


class SceneDocument:
    """The scene file (or None), its text, and the present settings.

    File names in settings and text are relative to `folder`.
    """

    def __init__(self, parameters: Parameters, handles: _Handles):
        """Read the scene file of the parameters; `handles` are those of the scene's objects."""
        file = resolve(parameters.scene_file) if parameters.scene_file else None
        self.folder = file.parent if file else home()
        self._text = _Text(file.read_text(encoding="utf-8-sig") if file else "", self.folder, handles)
        self._read = partial(settings_without_file, parameters, self.folder) if file is None else self._in_text
        self._settings: Settings | None = None
        is_imported = file is not None and cache_path() in file.parents  # from a V-REP file
        self.file = None if is_imported else file
        self._mtime: int | None = None  # ns, of the file when it was last written here

    def _in_text(self) -> Settings:
        return settings_of(self._text.content)

    @property
    def settings(self) -> Settings:
        """The scene file's content without objects and scripts."""
        if self._settings is None:
            self._settings = self._read()
        return self._settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._settings = settings

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether another program has modified the file since it was saved here."""
        return self.file is not None and self._mtime is not None and _mtime(self.file) != self._mtime

    def take_text(self, text: YamlText, handles: _Handles) -> None:
        """Use `text` as the text of the present scene."""
        self._text = _Text(text.text, self.folder, handles)

    def save_state(self) -> Restore:
        """Return a function that restores text and settings."""
        return saved(self, "_text", "_settings")

    def belong_to(self, file: Path | None, folder: Path, text: str, handles: _Handles) -> None:
        """Use another file (None: no file) with this text, and another folder."""
        self.file, self.folder, self._mtime = file, folder, _mtime(file) if file else None
        self._text = _Text(text, folder, handles)
        self._settings, self._read = None, self._in_text

    # ---- as a text

    def text(self, now: SceneContent, folder: Path | None = None) -> str:
        """Return the text of a scene file in `folder` (default: the present folder) for a scene."""
        content, kept = self._content(now, folder or self.folder)
        text = self._text.yaml.rewrite(content, kept)
        return text if has_values(text, content) else dump(content, "scene")

    def write(self, path: Path, now: SceneContent, parameters: Parameters) -> str:
        """Write a scene to a file and return the text. Another file that is overwritten is kept as FILE.bak.

        Raises ParameterError if the scene could not be loaded with the parameters, for example with the drone below
        the floor, and OSError; the file is then unchanged.
        """
        text = self.text(now, path.parent)
        try:
            parameters.with_content(yaml_files.parse(text), path.parent)
        except ValueError as error:
            raise ParameterError(f"the current scene cannot be saved: {error}") from None
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.resolve() != self.file and path.is_file():
            with contextlib.suppress(FileNotFoundError), writing.replacing(f"{path}.bak", binary=True) as backup:
                backup.write(path.read_bytes())
        writing.write(path, text)
        return text

    def _content(self, now: SceneContent, folder: Path) -> tuple[dict[str, Any], dict[str, list[int | None]]]:
        """Return the content for a file in `folder`, and the old index of each list item (None: new), by key."""
        before = self._text
        settings = with_files_seen_from(now.settings, self.folder, folder)
        objects, kept_objects = self._items("objects", before.entries, now.entries, folder)
        scripts, kept_scripts = self._items("scripts", before.scripts, now.scripts, folder)
        needed = {"objects"} if not before.content else before.content.keys()
        lists = {key: items for key, items in (("objects", objects), ("scripts", scripts)) if items or key in needed}
        result: dict[str, Any] = {**settings, **lists}
        ordered = {key: result[key] for key in (*before.content, *result) if key in result}
        return ordered, {"objects": kept_objects, "scripts": kept_scripts}

    def _items(
        self, section: str, before: Iterable[tuple[_Key, Checked]], now: Mapping[_Key, Checked], folder: Path
    ) -> tuple[list[Any], list[int | None]]:
        """Return the items of a list for a file in `folder`, and their indices in the text (None: new)."""
        items: list[Any] = []
        kept: list[int | None] = []
        rest = dict(now)
        for index, (key, old) in enumerate(before):
            item = rest.pop(key, None)
            if item is not None and type(item) is type(old):
                raw = self._text.content[section][index]
                items.append(_updated(raw, models.plain(old, self.folder), models.plain(item, folder)))
                kept.append(index)
            elif item is not None:
                rest[key] = item
        items += [models.in_order(models.plain(item, folder)) for item in rest.values()]
        kept += [None] * len(rest)
        return items, kept


class _Text:
    """A scene file's text, its parsed content, and its entries and scripts."""

    def __init__(self, text: str, folder: Path, handles: _Handles):
        self._source, self._folder, self._handles = text, folder, handles

    @cached_property
    def yaml(self) -> YamlText:
        return YamlText(self._source)

    @property
    def content(self) -> Mapping[str, Any]:
        return self.yaml.values

    @cached_property
    def entries(self) -> list[tuple[int, EntryParameters]]:
        """The entries of objects, each with the handle of its object (WORLD if it has none)."""
        entries = [scene_parameters.entry_from(values) for values in self._items("objects")]
        scene_parameters.name_shapes(entries)
        return [(self._handles.get(entry.name, WORLD), entry) for entry in entries]

    @cached_property
    def scripts(self) -> list[tuple[str, AttachedScriptParameters]]:
        """The scripts, each with the name of its object."""
        scripts = [scene_parameters.script_from(values) for values in self._items("scripts")]
        return [(script.object, script) for script in scripts]

    def _items(self, key: str) -> list[Any]:
        content = scene_parameters.from_content(copy.deepcopy(dict(self.content)), self._folder)
        return content["scene"].get(key) or []


def _mtime(path: Path) -> int | None:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _updated(raw: Mapping[str, Any], before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry `raw` of the text with the values that have changed from `before` to `now`."""
    keys = {key for key in {**before, **now} if before.get(key) != now.get(key)}
    written = {key: value for key, value in raw.items() if key not in keys or key in now}
    return {**written, **{key: now[key] for key in now if key in keys}}
