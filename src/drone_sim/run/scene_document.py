"""The scene file: its text, with the author's comments and order, its settings, and the text for the present scene.

Settings are all but objects and scripts, such as floor, vehicles and weather.
"""

from __future__ import annotations

import contextlib
import copy
import os
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from drone_sim.config.types import Checked, ParameterError, merged
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import cache_path, resolve
from drone_sim.files.yaml_writing import YamlText, dump, has_values
from drone_sim.forces.weather import WeatherParameters
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import first_free, split, suffixes
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.run.parameters import Parameters, load
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.entry import EntryParameters, pose_keys
from drone_sim.scene.scene_parameters import AttachedScriptParameters
from drone_sim.vehicles.parameters import PlaceParameters, VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

Settings = Mapping[str, Any]  # never modified in place
PLACE = ("position", "yaw", "tilt")
LISTS = ("objects", "scripts")  # keys of a scene file that are no settings
_TOLERANCE = 1e-9  # m, and elements of a rotation matrix
_VehicleSettings = dict[str, dict[str, Any]]  # by vehicle
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
        self._without_file = parameters if file is None else None  # whose scene has no text yet
        self._settings: Settings | None = None
        is_imported = file is not None and cache_path() in file.parents  # from a V-REP file
        self.file = None if is_imported else file
        self._mtime: int | None = None  # ns, of the file when it was last written here

    @property
    def settings(self) -> Settings:
        """The scene file's content without objects and scripts."""
        if self._settings is None and self._without_file is not None:
            self._settings = _settings_without_file(self._without_file, self.folder)
        elif self._settings is None:
            self._settings = settings_of(self._text.content)
        return self._settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._settings = settings

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether another program has modified the file since it was saved here."""
        return self.file is not None and self._mtime is not None and _mtime(self.file) != self._mtime

    def take_text(self, text: YamlText, handles: _Handles) -> None:
        self._text = _Text(text.text, self.folder, handles)

    def save_state(self) -> Restore:
        return saved(self, "_text", "_settings")

    def belong_to(self, file: Path | None, folder: Path, text: str, handles: _Handles) -> None:
        """Use another file (None: no file) with this text, and another folder."""
        self.file, self.folder, self._mtime = file, folder, _mtime(file) if file else None
        self._text = _Text(text, folder, handles)
        self._settings = self._without_file = None

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
        settings = _with_files_seen_from(now.settings, self.folder, folder)
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


# ---- settings


def settings_of(content: Mapping[str, Any]) -> Settings:
    return {key: value for key, value in content.items() if key not in LISTS}


def _settings_without_file(parameters: Parameters, folder: Path) -> Settings:
    """Return the settings that a scene file in `folder` would need for the scene of the parameters."""
    scene, default = parameters.scene, load().scene
    settings: dict[str, Any] = {}
    for key in ("floor", "datum"):
        if getattr(scene, key) != getattr(default, key):
            settings[key] = models.plain(getattr(scene, key), folder)
    if scene.magnetic_field != default.magnetic_field:
        settings["magnetic_field"] = list(scene.magnetic_field)
    if scene.collections:
        settings["collections"] = [group.model_dump(mode="json", exclude_defaults=True) for group in scene.collections]
    return with_vehicles(settings, vehicles_in({}, parameters), parameters)


def settings_now(
    settings: Settings, parameters: Parameters, vehicles: Mapping[str, Vehicle], weather: WeatherParameters
) -> Settings:
    """Return the settings, updated with the present poses of the vehicles and the present weather."""
    entries = vehicles_in(settings, parameters)
    has_moved = False
    for vehicle in parameters.fleet:
        entry, body = entries[vehicle.name], vehicles[vehicle.name].body
        # At its start the vehicle has its entry's pose, from which it may have been lowered to the floor.
        pose = vehicles[vehicle.name].parameters.matrix if are_same(body.matrix, body.start.matrix) else body.matrix
        start = frames.from_rpy(entry["position"], (*entry.get("tilt", vehicle.tilt), entry.get("yaw", vehicle.yaw)))
        if not are_same(pose, start):
            has_moved = True
            say_place(entry, pose, any(vehicle.tilt))
    if has_moved:
        settings = with_vehicles(settings, entries, parameters)
    if weather != parameters.weather:
        differences = _differences(weather.model_dump(mode="json"), parameters.weather.model_dump(mode="json"))
        settings = {**settings, "weather": merged(settings.get("weather") or {}, differences)}
    return settings


def as_between(now: Settings, before: Settings, after: Settings) -> Settings:
    """Return the settings `now` with the changes from `before` to `after`, also inside nested mappings."""
    result = dict(now)
    for key in {**before, **after}:
        old, new = before.get(key), after.get(key)
        if key not in after and key in before:
            result.pop(key, None)
        elif old != new:
            are_mappings = all(isinstance(value, Mapping) for value in (result.get(key), old, new))
            result[key] = as_between(result[key], old or {}, new or {}) if are_mappings else new
    return result


def are_same(one: Matrix, other: Matrix) -> bool:
    """Return whether two transforms are equal within 1e-9."""
    return all(abs(first - second) <= _TOLERANCE for first, second in zip(one, other))


def _differences(now: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys whose values differ from `before`, also inside nested mappings."""
    return {
        key: _differences(value, before[key]) if isinstance(value, Mapping) else value
        for key, value in now.items()
        if value != before[key]
    }


# ---- vehicles


def have_only_moved(before: Sequence[VehicleParameters], after: Sequence[VehicleParameters]) -> bool:
    """Return whether two fleets differ only in the vehicles' poses."""
    return len(before) == len(after) and all(
        old.is_alone == new.is_alone and old.model_copy(update={key: getattr(new, key) for key in PLACE}) == new
        for old, new in zip(before, after)
    )


def vehicles_in(settings: Settings, parameters: Parameters) -> _VehicleSettings:
    """Return the entry of each vehicle, by name, with at least its position."""
    configured = settings.get("vehicles")
    entries = configured if isinstance(configured, Mapping) else {}
    drone = settings.get("drone") if not entries else None
    default = {key: value for key, value in drone.items() if key != "name"} if isinstance(drone, Mapping) else {}
    result = {}
    for vehicle in parameters.fleet:
        entry = copy.deepcopy(entries.get(vehicle.name, default) or {})
        yaw = {"yaw": vehicle.yaw} if vehicle.yaw or "yaw" in entry else {}
        result[vehicle.name] = {"position": list(vehicle.position), **yaw, **entry}
    return result


def say_place(entry: dict[str, Any], matrix: Matrix, leans: bool = True) -> None:
    """Set the start pose in a vehicle's entry; roll and pitch only if `leans`."""
    keys = pose_keys(matrix)
    roll, pitch, yaw = keys["rpy"]
    entry["position"] = keys["position"]
    if yaw or "yaw" in entry:
        entry["yaw"] = yaw
    if leans and (roll or pitch or "tilt" in entry):
        entry["tilt"] = [roll, pitch]


def without_vehicles(settings: Settings) -> dict[str, Any]:
    return {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}


def with_vehicles(settings: Settings, fleet: _VehicleSettings, parameters: Parameters) -> Settings:
    """Return settings with the entries `fleet`, or with `drone:` if that is a single drone with only a start pose."""
    others = without_vehicles(settings)
    name = parameters.drone.name
    if "vehicles" not in settings and [*fleet] == [name] and fleet[name].keys() <= PlaceParameters.model_fields.keys():
        before = settings.get("drone") or {}
        return {**others, "drone": {**({"name": before["name"]} if "name" in before else {}), **fleet[name]}}
    return {**others, "vehicles": fleet}


def keep_names(entries: _VehicleSettings, vehicles: Mapping[str, Vehicle]) -> None:
    """Keep the object names of existing vehicles: write an explicit suffix where the default would differ."""
    free = suffixes()
    taken = {vehicles[name].suffix for name, entry in entries.items() if name in vehicles and "suffix" in entry}
    for name, entry in entries.items():
        if "suffix" in entry or name not in vehicles:
            continue
        present = vehicles[name].suffix
        if first_free(free, taken) != present:
            entry["suffix"] = split(f"_{present}")[1]


# ---- floor and files


def with_floor(settings: Settings, values: Mapping[str, Any]) -> Settings:
    """Return settings with changed keys of the floor; the value None removes a key, so that its default applies."""
    floor = {**(settings.get("floor") or {}), **values}
    floor = {key: value for key, value in floor.items() if value is not None}
    others = {key: value for key, value in settings.items() if key != "floor"}
    return {"floor": floor, **others} if floor else others


def _with_files_seen_from(settings: Settings, here: Path, there: Path) -> Settings:
    """Return settings whose file names, relative to the folder `here`, are made relative to the folder `there`."""
    if here == there:
        return settings
    content = scene_parameters.from_content(copy.deepcopy(dict(settings)), here)
    scene = content.pop("scene")
    seen = scene_parameters.renamed_files({**scene, **content}, lambda file: file.seen_from(there))
    return {key: seen[key] for key in settings}
