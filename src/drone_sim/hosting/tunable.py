"""What may be changed of a vehicle while it flies, and what it is called.

The names are the keys of the YAML files with slashes, a part of a list by a name of its own: weather/wind/x. Gains,
which are changed most often, go without their key: Kzref.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, get_args

from drone_sim.config.fields import ParameterField, comments, fields_of
from drone_sim.config.types import Checked, Key
from drone_sim.forces.weather import WeatherParameters
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.imperfections import Imperfections
from drone_sim.sensors.sensor import Failure
from drone_sim.vehicles.parameters import ControlParameters, EquipmentParameters, FaultParameters, VehicleParameters
from drone_sim.vehicles.types import propeller_places
from drone_sim.vehicles.types.quadricopter import Quadricopter

CONTROL, SCRIPT = "control", "script_parameters"
_PROPELLERS = "faults", "propellers"
LONGEST = 1000  # characters of a text
_LIMITS = ("takeoff_height", "cmd_vel_timeout", "cmd_vel_limits", "push", "position_limit")
_OF_CAMERAS = ("every", "horizontal_fov")
_LEFT_OUT = ("seed", "variance")  # the one is of a whole flight, the other only said
_EXPLAINED_CAMERA = "front"  # in config/drone.yaml: the others have the same keys


def tunables(vehicle: VehicleParameters, declared: Mapping[str, Any]) -> dict[str, ParameterField]:
    """Return what may be changed, by name. `declared` has the parameters that its script has beside the vehicle's."""
    found = [
        _explained(one)
        for name, camera in vehicle.cameras.items()
        for one in fields_of(CameraParameters, ("cameras", name))
        if one.location[-1] in _OF_CAMERAS or (camera.kind == "color" and _is_imperfection(one))
    ]
    for name, sensor in vehicle.sensors.items():
        kind: type[Checked] = type(sensor)
        for one in fields_of(kind, ("sensors", name)):
            if one.location[2] == "noise" and one.location[-1] not in _LEFT_OUT:
                found.append(one)
    for name in (*vehicle.sensors, *vehicle.cameras):
        location = "faults", "sensors", name
        found.append(ParameterField(location, str, choices=get_args(Failure), said="whether and how it fails"))
    script = _of_script({**vehicle.script_parameters, **declared})
    return {**common(vehicle.type), **{one.name: one for one in found}, **script}


def _is_imperfection(field: ParameterField) -> bool:
    return field.location[2] in Imperfections.model_fields and field.location[-1] not in _LEFT_OUT


@lru_cache(maxsize=16)
def common(type_name: str = Quadricopter.name) -> dict[str, ParameterField]:
    """Return what every vehicle of a type has, by name."""
    own = (*fields_of(ControlParameters, (CONTROL,)), *fields_of(EquipmentParameters))
    around = (*fields_of(WeatherParameters, ("weather",)), *fields_of(FaultParameters, ("faults",)))
    keys = (CONTROL, *_LIMITS, "weather", "faults")
    chosen = (one for one in (*own, *around) if one.location[0] in keys and one.location[-1] not in _LEFT_OUT)
    return {one.name.removeprefix(f"{CONTROL}/"): _explained(one) for one in _of_type(type_name, chosen)}


def _of_type(type_name: str, fields: Iterable[ParameterField]) -> Iterator[ParameterField]:
    """Yield the fields with one effectiveness for each propeller that the type has, in place of a quadricopter's."""
    for one in fields:
        if one.location[:2] != _PROPELLERS:
            yield one
        elif one.location[2] == 0:
            for index, place in enumerate(propeller_places(type_name)):
                yield one._replace(location=(*_PROPELLERS, index), part=place)


def _of_script(parameters: Mapping[str, Any]) -> dict[str, ParameterField]:
    """Return those that dynamic_reconfigure has a type for: numbers, switches, texts that are not too long."""
    bounds: dict[type, tuple[Any, Any]] = {float: (-math.inf, math.inf), bool: (False, True), str: (0.0, 0.0)}
    found = {}
    for key, value in parameters.items():
        kind = float if type(value) is int else type(value)
        if kind in bounds and not (isinstance(value, str) and len(value) > LONGEST):
            low, high = bounds[kind]
            one = ParameterField((SCRIPT, key), kind, low=low, high=high, said="of the child script")
            found[one.name] = one
    return found


def _explained(leaf: ParameterField) -> ParameterField:
    """Return it with what config/drone.yaml says."""
    keys: list[Key] = [one for one in leaf.location if isinstance(one, str)]
    if keys[0] == "cameras":
        keys[1] = _EXPLAINED_CAMERA
    return leaf._replace(said=comments().get("/".join(map(str, keys))) or leaf.said)


# ---- values


def value_at(tree: Any, location: Sequence[Key]) -> Any:
    """Return what stands at a location of models, mappings and lists; None where nothing does."""
    for key in location:
        if isinstance(tree, Mapping):
            tree = tree.get(key)
        elif isinstance(key, int):
            tree = tree[key] if isinstance(tree, (list, tuple)) and key < len(tree) else None
        else:
            tree = getattr(tree, key, None)
    return tree


def nested(known: Mapping[str, ParameterField], now: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes by name as YAML has them; parts of a list that they leave out are as they are `now`.

    Raises KeyError for such a part that is not there either.
    """
    made: dict[str, Any] = {}
    for name, value in changes.items():
        leaf = known[name]
        whole, given = leaf.location, value
        if leaf.part:
            whole = leaf.location[:-1]
            parts = [other for other, one in known.items() if one.part and one.location[:-1] == whole]
            given = [changes[other] if other in changes else now[other] for other in parts]
        elif leaf.none is not None and value == leaf.none:
            given = "none"
        here = made
        for key in whole[:-1]:
            here = here.setdefault(str(key), {})
        here[str(whole[-1])] = given
    return made
