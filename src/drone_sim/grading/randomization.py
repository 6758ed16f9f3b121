"""Random variation of a flight by its seed: start poses, wind, and the seeds of noise, gusts and faults.

Seed 0 changes nothing. With any other seed, each quantity has a random generator of its own, made from the seed and a
name (`position/drone`, `wind`, ...), so that a new quantity in a plan does not change the values of the others.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from drone_sim.config.types import Checked, Finite, Label, ParameterError, Within
from drone_sim.message_text import near_names
from drone_sim.run.parameters import Parameters
from drone_sim.scene.scene_parameters import MAX_OBJECTS, SceneParameters
from drone_sim.vehicles.parameters import VehicleParameters

_Metres = Annotated[Finite, Within(0, 1000)]
_Width = Annotated[tuple[_Metres, _Metres, _Metres], Field(description="3 numbers, [x, y, z] in m")]
_Speed = Annotated[Finite, Within(0, 50)]
_MAX_WIND = 100.0  # m/s, the limit of config/drone.yaml
_SEEDS = 2**63


class Randomization(Checked):
    """Half the widths of uniform distributions about the values of the plan; 0 for no variation."""

    position: _Width = (0, 0, 0)
    yaw: Annotated[Finite, Within(0, 3.15)] = 0.0  # rad
    objects: Annotated[dict[Label, _Width], Field(max_length=MAX_OBJECTS)] = Field(default_factory=dict)
    wind: Annotated[tuple[_Speed, _Speed, _Speed], Field(description="3 numbers, [x, y, z] in m/s")] = (0, 0, 0)


def randomize(parameters: Parameters, spread: Randomization, seed: int) -> Parameters:
    """Return the parameters of the flight with a seed."""
    if seed == 0:
        return parameters
    weather = parameters.weather
    gusts = weather.gusts.model_copy(update={"seed": _seed(seed, "gusts", weather.gusts.seed)})
    wind = np.clip(_draw_about(weather.wind, spread.wind, seed, "wind"), -_MAX_WIND, _MAX_WIND)
    new_weather = weather.model_copy(update={"gusts": gusts, "wind": tuple(wind.tolist())})
    fleet = tuple(_randomize_vehicle(vehicle, spread, seed) for vehicle in parameters.fleet)
    return parameters.varied(new_weather, _randomize_scene(parameters.scene, spread, seed), fleet)


def check_objects(parameters: Parameters, spread: Randomization) -> None:
    """Raise ParameterError for an object that the scene does not have."""
    known = [entry.name for entry in parameters.scene.objects if entry.name]
    for name in spread.objects:
        if name not in known:
            reason = f"no such object of the scene; {near_names(name, known)}" if known else "the scene has none"
            raise ParameterError(reason, ("spread", "objects", name))


def _randomize_scene(scene: SceneParameters, spread: Randomization, seed: int) -> SceneParameters:
    if not spread.objects:
        return scene
    objects = []
    for entry in scene.objects:
        if (width := spread.objects.get(entry.name)) is not None:
            position = _draw_about(entry.position, width, seed, f"objects/{entry.name}").tolist()
            entry = entry.model_copy(update={"position": tuple(position)})
        objects.append(entry)
    return scene.model_copy(update={"objects": objects})


def _randomize_vehicle(vehicle: VehicleParameters, spread: Randomization, seed: int) -> VehicleParameters:
    x, y, z = map(float, _draw_about(vehicle.position, spread.position, seed, f"position/{vehicle.name}"))
    (yaw,) = map(float, _draw_about((vehicle.yaw,), (spread.yaw,), seed, f"yaw/{vehicle.name}"))
    faults = vehicle.faults.model_copy(update={"seed": _seed(seed, f"faults/{vehicle.name}", vehicle.faults.seed)})
    sensors = {
        name: sensor.model_copy(update={"seed": _seed(seed, f"sensors/{vehicle.name}/{name}", sensor.seed)})
        for name, sensor in vehicle.sensors.items()
    }
    pose = {"position": (x, y, max(0.0, z)), "yaw": yaw}
    return vehicle.model_copy(update={**pose, "faults": faults, "sensors": sensors})


def _draw_about(centre: Any, widths: Any, seed: int, name: str) -> np.ndarray:
    """Return numbers drawn uniformly within `widths` about `centre`; with a width of 0, the centre itself."""
    shares = _generator(seed, name).uniform(-1.0, 1.0, len(widths))
    return np.asarray(centre, float) + np.asarray(widths, float) * shares


def _seed(seed: int, name: str, plan_seed: int) -> int:
    """Return a new seed of noise, gusts or faults, which also depends on the seed in the plan."""
    return int(_generator(seed, f"{name}/{plan_seed}").integers(_SEEDS))


def _generator(seed: int, name: str) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([seed, *name.encode()]))
