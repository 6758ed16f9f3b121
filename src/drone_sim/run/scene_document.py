"""The scene as a file: the text that it was read from, which keeps what its author wrote, and what it would say now."""

from __future__ import annotations

import contextlib
import copy
import os
from collections.abc import Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.config.types import ParameterError
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import cache_path, resolve
from drone_sim.files.yaml_text import YamlText, dumped, says
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_settings import Settings, settings_of, settings_without_file, with_files_seen_from
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters

_Handles = Mapping[str, int]  # of objects, by their names


def home() -> Path:
    """Return the folder for scenes that have no file, or whose folder cannot be written to."""
    return Path(os.path.expanduser("~/.ros/drone_sim"))


class SceneContent(NamedTuple):
    """A scene at a moment: entries by the handles of their objects, scripts by the names of theirs."""

    entries: Mapping[int, EntryParameters]
    scripts: Mapping[str, AttachedScriptParameters]
    settings: Settings


class SceneDocument:
    """The file of a scene, or none, its text, and its settings, as they are by now.

    Settings and text name files relative to `folder`.
    """

    def __init__(self, parameters: Parameters, handles: _Handles):
        """Take the scene file of the parameters; `handles` are those of its objects."""
        file = resolve(parameters.scene_file) if parameters.scene_file else None
        self.folder = file.parent if file else home()
        self._text = _Text(file.read_text(encoding="utf-8-sig") if file else "", self.folder, handles)
        self._read = partial(settings_without_file, parameters, self.folder) if file is None else self._in_text
        self._settings: Settings | None = None
        is_made = file is not None and cache_path() in file.parents  # of one of V-REP's
        self.file = None if is_made else file
        self._age: int | None = None  # when this wrote the file, as the disk says it

    def _in_text(self) -> Settings:
        return settings_of(self._text.said)

    @property
    def settings(self) -> Settings:
        """What is said beside objects and scripts."""
        if self._settings is None:
            self._settings = self._read()
        return self._settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._settings = settings

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether somebody has written the file since it was saved here."""
        return self.file is not None and self._age is not None and _age(self.file) != self._age

    def take_text(self, text: YamlText, handles: _Handles) -> None:
        """Know that a text says what the scene is now."""
        self._text = _Text(text.text, self.folder, handles)

    def save_state(self) -> Restore:
        """Return a function that brings text and settings back."""
        return saved(self, "_text", "_settings")

    def belong_to(self, file: Path | None, folder: Path, text: str, handles: _Handles) -> None:
        """Belong to another file with this text, or to no file, in another folder."""
        self.file, self.folder, self._age = file, folder, _age(file) if file else None
        self._text = _Text(text, folder, handles)
        self._settings, self._read = None, self._in_text

    # ---- as a text

    def text(self, now: SceneContent, folder: Path | None = None) -> str:
        """Return what a file in a folder, its own where none is given, would say of a scene."""
        said, kept = self._said(now, folder or self.folder)
        text = self._text.yaml.rewritten(said, kept)
        return text if says(text, said) else dumped(said)

    def write(self, path: Path, now: SceneContent, parameters: Parameters) -> str:
        """Write a scene into a file; return the text. What another file said before stays beside it, as FILE.bak.

        Raises ParameterError where that would be no scene that can be loaded with the parameters, such as with the
        drone below the floor, and OSError; what was in the file is then still there.
        """
        text = self.text(now, path.parent)
        try:
            parameters.with_content(yaml_files.parse(text), path.parent)
        except ValueError as error:
            raise ParameterError(f"the current scene cannot be saved: {error}") from None
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.resolve() != self.file and path.is_file():
            with contextlib.suppress(FileNotFoundError), writing.replacing(f"{path}.bak", binary=True) as before:
                before.write(path.read_bytes())
        writing.write(path, text)
        return text

    def _said(self, now: SceneContent, folder: Path) -> tuple[dict[str, Any], dict[str, list[int | None]]]:
        """Return what a file in a folder says of a scene, and which items of its lists the text had."""
        before, here = self._text, self.folder
        items: list[Any] = []
        kept: list[int | None] = []
        rest = dict(now.entries)
        for index, (handle, one) in enumerate(before.entries):
            entry = rest.pop(handle, None)
            if entry is not None and type(entry) is type(one):
                raw = before.said["objects"][index]
                items.append(_changed(raw, models.plain(one, here), models.plain(entry, folder)))
                kept.append(index)
            elif entry is not None:
                rest[handle] = entry
        new = [models.in_order(models.plain(one, folder)) for one in rest.values()]
        new_scripts, kept_scripts = self._script_items(now.scripts, folder)
        settings = with_files_seen_from(now.settings, here, folder)
        lists = {"objects": [*items, *new], "scripts": new_scripts}
        needed = {"objects"} if not before.said else before.said.keys()
        said: dict[str, Any] = {**settings, **{key: one for key, one in lists.items() if one or key in needed}}
        ordered = {key: said[key] for key in (*before.said, *said) if key in said}
        return ordered, {"objects": [*kept, *[None] * len(new)], "scripts": kept_scripts}

    def _script_items(
        self, now: Mapping[str, AttachedScriptParameters], folder: Path
    ) -> tuple[list[Any], list[int | None]]:
        items, kept, rest = [], [], dict(now)
        for index, before in enumerate(self._text.scripts):
            script = rest.pop(before.object, None)
            if script is not None:
                raw = self._text.said["scripts"][index]
                items.append(_changed(raw, models.plain(before, self.folder), models.plain(script, folder)))
                kept.append(index)
        return [*items, *(models.plain(one, folder) for one in rest.values())], [*kept, *[None] * len(rest)]


class _Text:
    """A text, and what it says, in the words of the scene."""

    def __init__(self, text: str, folder: Path, handles: _Handles):
        self._given, self._folder, self._handles = text, folder, handles

    @cached_property
    def yaml(self) -> YamlText:
        return YamlText(self._given)

    @property
    def said(self) -> Mapping[str, Any]:
        return self.yaml.values

    @cached_property
    def entries(self) -> list[tuple[int, EntryParameters]]:
        """The entries, each with the handle of its object."""
        entries = [scene_parameters.entry_from(one) for one in self._found("objects")]
        scene_parameters.name_shapes(entries)
        return [(self._handles.get(one.name, WORLD), one) for one in entries]

    @cached_property
    def scripts(self) -> list[AttachedScriptParameters]:
        return [scene_parameters.script_from(one) for one in self._found("scripts")]

    def _found(self, key: str) -> list[Any]:
        found = scene_parameters.from_content(copy.deepcopy(dict(self.said)), self._folder)
        return found["scene"].get(key) or []


def _age(path: Path) -> int | None:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _changed(raw: Mapping[str, Any], before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry as it was written in the text, with the values that have changed since."""
    keys = {key for key in {**before, **now} if before.get(key) != now.get(key)}
    written = {key: value for key, value in raw.items() if key not in keys or key in now}
    return {**written, **{key: now[key] for key in now if key in keys}}
