"""What a scene file says beside objects and scripts: the floor, who flies, the weather."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import FoundFile, merged
from drone_sim.forces.weather import WeatherParameters
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import split
from drone_sim.run.parameters import Parameters, load
from drone_sim.scene import models, scene_parameters
from drone_sim.vehicles.parameters import PlaceParameters, VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

Settings = Mapping[str, Any]  # never changed, but replaced
PLACE = ("position", "yaw", "tilt")
LISTS = ("objects", "scripts")  # what of a scene file is no setting
_SAME = 1e-9  # m, and of a turn's matrix
_Said = dict[str, dict[str, Any]]


def settings_of(said: Mapping[str, Any]) -> Settings:
    """Return those of a scene file's content."""
    return {key: value for key, value in said.items() if key not in LISTS}


def settings_without_file(parameters: Parameters, folder: Path) -> Settings:
    """Return what a file in `folder` would say of the scene of the parameters."""
    own, default = parameters.scene, load().scene
    settings: dict[str, Any] = {}
    for key in ("floor", "datum"):
        if getattr(own, key) != getattr(default, key):
            settings[key] = models.plain(getattr(own, key), folder)
    if own.magnetic_field != default.magnetic_field:
        settings["magnetic_field"] = list(own.magnetic_field)
    if own.collections:
        settings["collections"] = [one.model_dump(mode="json", exclude_defaults=True) for one in own.collections]
    return with_vehicles(settings, vehicles_in({}, parameters), parameters)


def settings_now(
    settings: Settings, parameters: Parameters, vehicles: Mapping[str, Vehicle], weather: WeatherParameters
) -> Settings:
    """Return settings with vehicles where they are, and the weather that there is, where that is not as they say."""
    said = vehicles_in(settings, parameters)
    moved = False
    for one in parameters.fleet:
        own, now = said[one.name], _place_now(vehicles[one.name])
        begins = frames.from_rpy(own["position"], (*own.get("tilt", one.tilt), own.get("yaw", one.yaw)))
        if not are_same(now, begins):
            moved = True
            say_place(own, now, any(one.tilt))
    if moved:
        settings = with_vehicles(settings, said, parameters)
    if weather != parameters.weather:
        otherwise = _otherwise(weather.model_dump(mode="json"), parameters.weather.model_dump(mode="json"))
        settings = {**settings, "weather": merged(settings.get("weather") or {}, otherwise)}
    return settings


def _place_now(vehicle: Vehicle) -> Matrix:
    """Return where a vehicle is; one that has not moved yet is where its entry says, if only above the floor there."""
    body = vehicle.body
    return vehicle.parameters.matrix if are_same(body.matrix, body.start.matrix) else body.matrix


def as_between(now: Settings, before: Settings, after: Settings) -> Settings:
    """Return the settings `now` with the changes from `before` to `after`, also inside nested mappings."""
    made = dict(now)
    for key in {**before, **after}:
        one, two = before.get(key), after.get(key)
        if key not in after and key in before:
            made.pop(key, None)
        elif one != two:
            are_maps = all(isinstance(each, Mapping) for each in (made.get(key), one, two))
            made[key] = as_between(made[key], one or {}, two or {}) if are_maps else two
    return made


def are_same(one: Matrix, other: Matrix) -> bool:
    """Tell whether two transforms are the same, to 1e-9."""
    return all(abs(first - second) <= _SAME for first, second in zip(one, other))


def _otherwise(now: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys that have other values than before, of mappings inside, too."""
    return {
        key: _otherwise(value, before[key]) if isinstance(value, Mapping) else value
        for key, value in now.items()
        if value != before[key]
    }


# ---- who flies


def vehicles_in(settings: Settings, parameters: Parameters) -> _Said:
    """Return what is said of each vehicle, by its name, of which at least the place."""
    given = settings.get("vehicles")
    said = given if isinstance(given, Mapping) else {}
    drone = settings.get("drone") if not said else None
    alone = {key: value for key, value in drone.items() if key != "name"} if isinstance(drone, Mapping) else {}
    own = {one.name: said.get(one.name, alone) or {} for one in parameters.fleet}
    return {one.name: {**_place(one, own[one.name]), **copy.deepcopy(own[one.name])} for one in parameters.fleet}


def _place(one: VehicleParameters, said: Mapping[str, Any]) -> dict[str, Any]:
    place: dict[str, Any] = {"position": list(one.position)}
    return {**place, "yaw": one.yaw} if one.yaw or "yaw" in said else place


def say_place(said: dict[str, Any], matrix: Matrix, leans: bool = True) -> None:
    """Let what is said of a vehicle say that it begins there; `leans`: at that roll and pitch, too."""
    (roll, pitch, yaw), position = (
        [round(one, 9) + 0.0 for one in three] for three in (frames.to_rpy(matrix), frames.position(matrix))
    )
    said["position"] = position
    if yaw or "yaw" in said:
        said["yaw"] = yaw
    if leans and (roll or pitch or "tilt" in said):
        said["tilt"] = [roll, pitch]


def with_vehicles(settings: Settings, said: _Said, parameters: Parameters) -> Settings:
    """Return settings that say this of the vehicles; the only drone stays `drone:` where nothing else asks for more."""
    others = {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}
    drone = parameters.drone.name
    if "vehicles" not in settings and [*said] == [drone] and said[drone].keys() <= PlaceParameters.model_fields.keys():
        before = settings.get("drone") or {}
        return {**others, "drone": {**({"name": before["name"]} if "name" in before else {}), **said[drone]}}
    return {**others, "vehicles": said}


def keep_names(said: _Said, vehicles: Mapping[str, Vehicle]) -> None:
    """Let those who stay have the names that their objects have: their suffixes are said where they would differ."""
    free = itertools.chain([""], map("#{}".format, itertools.count()))
    taken = {vehicles[name].suffix for name, one in said.items() if name in vehicles and "suffix" in one}
    for name, one in said.items():
        if "suffix" in one or name not in vehicles:
            continue
        own = vehicles[name].suffix
        if next(suffix for suffix in free if suffix not in taken) != own:
            one["suffix"] = split(f"_{own}")[1]


# ---- floor and files


def with_floor(settings: Settings, values: Mapping[str, Any]) -> Settings:
    """Return settings with other keys of the floor; None among them is what is so by default."""
    floor = {**(settings.get("floor") or {}), **values}
    floor = {key: value for key, value in floor.items() if value is not None}
    others = {key: value for key, value in settings.items() if key != "floor"}
    return {"floor": floor, **others} if floor else others


def with_files_seen_from(settings: Settings, here: Path, there: Path) -> Settings:
    """Return the settings of a file in one folder, their files named as a file in another one can name them."""
    if here == there:
        return settings
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
