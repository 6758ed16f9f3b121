"""What a scene file says beside objects and scripts: the floor, and who flies."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping
from typing import Any

from drone_sim.editing.changes import Settings
from drone_sim.mechanics.object_names import split
from drone_sim.run.parameters import Parameters
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

PLACE = ("position", "yaw", "tilt")
_Said = dict[str, dict[str, Any]]


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


def with_vehicles(settings: Settings, said: _Said, parameters: Parameters) -> Settings:
    """Return settings that say this of the vehicles; the only drone stays `drone:` where nothing else asks for more."""
    others = {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}
    drone = parameters.drone.name
    if "vehicles" not in settings and [*said] == [drone] and all(key in (*PLACE, "objects") for key in said[drone]):
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


def with_floor(settings: Settings, values: Mapping[str, Any]) -> Settings:
    """Return settings with other keys of the floor; None among them is what is so by default."""
    floor = {**(settings.get("floor") or {}), **values}
    floor = {key: value for key, value in floor.items() if value is not None}
    others = {key: value for key, value in settings.items() if key != "floor"}
    return {"floor": floor, **others} if floor else others
