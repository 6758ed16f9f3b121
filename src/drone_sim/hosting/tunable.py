"""Parameters of a vehicle that can be tuned in flight (with dynamic_reconfigure), and their names.

The names are the keys of the YAML files joined by slashes; elements of a list have names, too: weather/wind/x. Gains,
which are tuned most often, are named without their key: Kzref.
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
from drone_sim.vehicles.types import QUADRICOPTER, propeller_places

CONTROL, SCRIPT = "control", "script_parameters"
_PROPELLERS = "faults", "propellers"
LONGEST = 1000  # characters of a string
_LIMITS = ("takeoff_height", "cmd_vel_timeout", "cmd_vel_limits", "push", "position_limit")
_CAMERA_KEYS = ("every", "horizontal_fov")
_EXCLUDED = ("seed", "variance")  # `seed` is for a whole flight, `variance` is only reported
_DOCUMENTED_CAMERA = "front"  # in config/drone.yaml; other cameras have the same keys


def tunables(vehicle: VehicleParameters, declared: Mapping[str, Any]) -> dict[str, ParameterField]:
    """Return the tunable parameters by name. `declared`: parameters that only the vehicle's script defines."""
    fields = [
        _with_comment(field)
        for name, camera in vehicle.cameras.items()
        for field in fields_of(CameraParameters, ("cameras", name))
        if field.location[-1] in _CAMERA_KEYS or (camera.kind == "color" and _is_imperfection(field))
    ]
    for name, sensor in vehicle.sensors.items():
        kind: type[Checked] = type(sensor)
        for field in fields_of(kind, ("sensors", name)):
            if field.location[2] == "noise" and field.location[-1] not in _EXCLUDED:
                fields.append(field)
    for name in (*vehicle.sensors, *vehicle.cameras):
        location = "faults", "sensors", name
        description = "failure of the sensor, if any"
        fields.append(ParameterField(location, str, choices=get_args(Failure), description=description))
    of_script = _script_fields({**vehicle.script_parameters, **declared})
    return {**common(vehicle.type), **{field.name: field for field in fields}, **of_script}


def _is_imperfection(field: ParameterField) -> bool:
    return field.location[2] in Imperfections.model_fields and field.location[-1] not in _EXCLUDED


@lru_cache(maxsize=16)
def common(type_name: str = QUADRICOPTER.name) -> dict[str, ParameterField]:
    """Return the tunable parameters of every vehicle of a type, by name."""
    vehicle = (*fields_of(ControlParameters, (CONTROL,)), *fields_of(EquipmentParameters))
    around = (*fields_of(WeatherParameters, ("weather",)), *fields_of(FaultParameters, ("faults",)))
    keys = (CONTROL, *_LIMITS, "weather", "faults")
    chosen = (leaf for leaf in (*vehicle, *around) if leaf.location[0] in keys and leaf.location[-1] not in _EXCLUDED)
    return {field.name.removeprefix(f"{CONTROL}/"): _with_comment(field) for field in _for_type(type_name, chosen)}


def _for_type(type_name: str, fields: Iterable[ParameterField]) -> Iterator[ParameterField]:
    """Yield the fields, with an effectiveness for each propeller of the type instead of a quadricopter's four."""
    for field in fields:
        if field.location[:2] != _PROPELLERS:
            yield field
        elif field.location[2] == 0:
            for index, place in enumerate(propeller_places(type_name)):
                yield field._replace(location=(*_PROPELLERS, index), part=place)


def _script_fields(parameters: Mapping[str, Any]) -> dict[str, ParameterField]:
    """Return the parameters with a type of dynamic_reconfigure: numbers, bools, strings up to LONGEST."""
    bounds: dict[type, tuple[Any, Any]] = {float: (-math.inf, math.inf), bool: (False, True), str: (0.0, 0.0)}
    fields = {}
    for key, value in parameters.items():
        kind = float if type(value) is int else type(value)
        if kind in bounds and not (isinstance(value, str) and len(value) > LONGEST):
            low, high = bounds[kind]
            field = ParameterField((SCRIPT, key), kind, low=low, high=high, description="of the child script")
            fields[field.name] = field
    return fields


def _with_comment(leaf: ParameterField) -> ParameterField:
    """Return the field with its comment in config/drone.yaml as description."""
    keys: list[Key] = [key for key in leaf.location if isinstance(key, str)]
    if keys[0] == "cameras":
        keys[1] = _DOCUMENTED_CAMERA
    return leaf._replace(description=comments().get("/".join(map(str, keys))) or leaf.description)


# ---- values


def value_at(tree: Any, location: Sequence[Key]) -> Any:
    """Return the value at a location in nested models, mappings and lists; None if there is none."""
    for key in location:
        if isinstance(tree, Mapping):
            tree = tree.get(key)
        elif isinstance(key, int):
            tree = tree[key] if isinstance(tree, (list, tuple)) and key < len(tree) else None
        else:
            tree = getattr(tree, key, None)
    return tree


def nested(known: Mapping[str, ParameterField], now: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes, given by name, as nested mappings; missing elements of a list are taken from `now`.

    Raises KeyError if an element is missing there, too.
    """
    result: dict[str, Any] = {}
    for name, value in changes.items():
        leaf = known[name]
        location, new_value = leaf.location, value
        if leaf.part:
            location = leaf.location[:-1]
            parts = [other for other, field in known.items() if field.part and field.location[:-1] == location]
            new_value = [changes[other] if other in changes else now[other] for other in parts]
        elif leaf.none is not None and value == leaf.none:
            new_value = "none"
        mapping = result
        for key in location[:-1]:
            mapping = mapping.setdefault(str(key), {})
        mapping[str(location[-1])] = new_value
    return result
