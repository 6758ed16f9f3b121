"""A scene as it stands, written as a scene file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from drone_sim.config.types import ParameterError
from drone_sim.files import writing, yaml_files
from drone_sim.forces.weather import WeatherParameters
from drone_sim.mechanics import frames
from drone_sim.run.parameters import Parameters, load
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.scene import Scene
from drone_sim.vehicles.vehicle import Vehicle

_HEAD = "# Written by save_scene: metres, radians; a datum in degrees, a magnetic field in tesla.\n"


def save(
    path: Path, parameters: Parameters, scene: Scene, vehicles: Iterable[Vehicle], weather: WeatherParameters
) -> None:
    """Write what of floor, objects, vehicles and weather is not as by default. The scene's own files keep their names.

    What was in the file and was not written here stays beside it, as FILE.bak.

    Raises ParameterError where that would be no scene that can be loaded, such as with the drone below the
    floor, and OSError; what was in the file is then still there.
    """
    own, default = scene.parameters, load().scene
    said = parameters.in_scene_file
    content: dict[str, Any] = {key: said[key] for key in scene_parameters.WORLD if key in said}
    if "weather" in said or weather != parameters.weather:
        content["weather"] = weather.model_dump(mode="json")
    if own.datum != default.datum:
        content["datum"] = own.datum.model_dump()
    if own.magnetic_field != default.magnetic_field:
        content["magnetic_field"] = list(own.magnetic_field)
    if own.floor != default.floor:
        content["floor"] = models.plain(own.floor, path.parent)
    content.update(_flying(parameters, vehicles, path.parent))
    content["objects"] = _objects(scene, path.parent)
    if scene.scripts:
        content["scripts"] = [models.plain(one, path.parent) for one in scene.scripts.values()]
    if own.collections:
        content["collections"] = [one.model_dump(mode="json", exclude_defaults=True) for one in own.collections]
    text = _HEAD + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    try:
        parameters.check_scene(yaml_files.parse(text), path)
    except ValueError as error:
        raise ParameterError(f"the scene as it stands cannot be saved: {error}") from None
    path.parent.mkdir(parents=True, exist_ok=True)
    _keep_what_others_wrote(path)
    writing.write(path, text)


def _keep_what_others_wrote(path: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        before = path.read_bytes()
        if not before.startswith(_HEAD.encode()):
            with writing.replacing(path.with_name(f"{path.name}.bak"), binary=True) as kept:
                kept.write(before)


def _flying(parameters: Parameters, vehicles: Iterable[Vehicle], folder: Path) -> dict[str, Any]:
    """Return the drone, or the vehicles, where they are, with what the last scene file said of them."""
    said = parameters.in_scene_file
    if parameters.fleet and not parameters.vehicles:
        (drone,) = vehicles
        return {"drone": {**_named(said.get("drone"), folder), **_place(drone)}}
    entries = said.get("vehicles")
    own = entries if isinstance(entries, dict) else {}
    return {"vehicles": {one.name: {**_named(own.get(one.name), folder), **_place(one)} for one in vehicles}}


def _place(vehicle: Vehicle) -> dict[str, Any]:
    roll, pitch, yaw = frames.to_rpy(vehicle.body.matrix)
    place: dict[str, Any] = {"position": list(frames.position(vehicle.body.matrix)), "yaw": yaw}
    return {**place, "tilt": [roll, pitch]} if any(vehicle.parameters.tilt) else place


def _named(said: Any, folder: Path) -> dict[str, Any]:
    """Return what a scene file said, its files named as a scene file in `folder` can name them."""
    return {key: models.file_name(value, folder) for key, value in said.items()} if isinstance(said, dict) else {}


def _objects(scene: Scene, folder: Path) -> list[dict[str, Any]]:
    """Return the entries without the keys that say that one is upright, or hangs on nothing."""
    entries = [{**models.plain(one, folder), **scene.now(index)} for index, one in scene.entries.items()]
    for one in entries:
        if not any(one["rpy"]):
            del one["rpy"]
        if not one["parent"]:
            del one["parent"]
    return entries
