"""Settings of a scene file: all but objects and scripts, such as floor, vehicles and weather."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.config.types import merged
from drone_sim.forces.weather import WeatherParameters
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import first_free, split, suffixes
from drone_sim.run.parameters import Parameters, load
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.entry import pose_keys
from drone_sim.vehicles.parameters import PlaceParameters, VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

Settings = Mapping[str, Any]  # never modified in place
PLACE = ("position", "yaw", "tilt")
LISTS = ("objects", "scripts")  # keys of a scene file that are no settings
_TOLERANCE = 1e-9  # m, and elements of a rotation matrix
_VehicleSettings = dict[str, dict[str, Any]]  # by vehicle


def settings_of(content: Mapping[str, Any]) -> Settings:
    """Return the settings in the content of a scene file."""
    return {key: value for key, value in content.items() if key not in LISTS}


def settings_without_file(parameters: Parameters, folder: Path) -> Settings:
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
    """Return settings without the keys of the vehicles."""
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


def with_files_seen_from(settings: Settings, here: Path, there: Path) -> Settings:
    """Return settings whose file names, relative to the folder `here`, are made relative to the folder `there`."""
    if here == there:
        return settings
    content = scene_parameters.from_content(copy.deepcopy(dict(settings)), here)
    scene = content.pop("scene")
    seen = scene_parameters.renamed_files({**scene, **content}, lambda file: file.seen_from(there))
    return {key: seen[key] for key in settings}
