"""What a flight's seed changes: where the vehicles start, the wind, and the seeds of noise, gusts and faults.

Seed 0 changes nothing. With any other, everything draws from a random generator of its own, of the seed and a name
(`position/drone`, `wind`, ...), so that what is added to a plan changes nothing of what was there.
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
_WINDIEST = 100.0  # m/s, as config/drone.yaml allows
_SEEDS = 2**63


class Randomization(Checked):
    """Half the width of a uniform distribution about what is given; 0, or left out: as it is given."""

    position: _Width = (0, 0, 0)
    yaw: Annotated[Finite, Within(0, 3.15)] = 0.0  # rad
    objects: Annotated[dict[Label, _Width], Field(max_length=MAX_OBJECTS)] = Field(default_factory=dict)
    wind: Annotated[tuple[_Speed, _Speed, _Speed], Field(description="3 numbers, [x, y, z] in m/s")] = (0, 0, 0)


def randomized(parameters: Parameters, spread: Randomization, seed: int) -> Parameters:
    """Return what a flight of this seed begins with."""
    if seed == 0:
        return parameters
    weather = parameters.weather
    gusts = weather.gusts.model_copy(update={"seed": _seed(seed, "gusts", weather.gusts.seed)})
    wind = np.clip(_about(weather.wind, spread.wind, seed, "wind"), -_WINDIEST, _WINDIEST)
    changed = weather.model_copy(update={"gusts": gusts, "wind": tuple(wind.tolist())})
    fleet = tuple(_vehicle(one, spread, seed) for one in parameters.fleet)
    return parameters.varied(changed, _scene(parameters.scene, spread, seed), fleet)


def check_objects(parameters: Parameters, spread: Randomization) -> None:
    """Raise ParameterError for an object that the scene has not."""
    known = [one.name for one in parameters.scene.objects if one.name]
    for name in spread.objects:
        if name not in known:
            said = f"no such object of the scene; {near_names(name, known)}" if known else "the scene has none"
            raise ParameterError(said, ("spread", "objects", name))


def _scene(scene: SceneParameters, spread: Randomization, seed: int) -> SceneParameters:
    if not spread.objects:
        return scene
    objects = []
    for one in scene.objects:
        width = spread.objects.get(one.name)
        place = None if width is None else _about(one.position, width, seed, f"objects/{one.name}").tolist()
        objects.append(one if place is None else one.model_copy(update={"position": tuple(place)}))
    return scene.model_copy(update={"objects": objects})


def _vehicle(own: VehicleParameters, spread: Randomization, seed: int) -> VehicleParameters:
    x, y, z = map(float, _about(own.position, spread.position, seed, f"position/{own.name}"))
    (yaw,) = map(float, _about((own.yaw,), (spread.yaw,), seed, f"yaw/{own.name}"))
    faults = own.faults.model_copy(update={"seed": _seed(seed, f"faults/{own.name}", own.faults.seed)})
    sensors = {
        name: one.model_copy(update={"seed": _seed(seed, f"sensors/{own.name}/{name}", one.seed)})
        for name, one in own.sensors.items()
    }
    place = {"position": (x, y, max(0.0, z)), "yaw": yaw}
    return own.model_copy(update={**place, "faults": faults, "sensors": sensors})


def _about(middle: Any, widths: Any, seed: int, what: str) -> np.ndarray:
    """Return numbers, each drawn from within its width of the middle; where there is no width, the middle itself."""
    drawn = _generator(seed, what).uniform(-1.0, 1.0, len(widths))
    return np.asarray(middle, float) + np.asarray(widths, float) * drawn


def _seed(seed: int, what: str, given: int) -> int:
    """Return the seed of noise, gusts or faults; it depends on the plan's own one, too."""
    return int(_generator(seed, f"{what}/{given}").integers(_SEEDS))


def _generator(seed: int, what: str) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([seed, *what.encode()]))
