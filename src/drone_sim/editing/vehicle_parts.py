"""The cameras and sensors of vehicles: their objects, and their values in the scene file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from drone_sim.config.types import flattened, nested
from drone_sim.editing.properties import inner_fields, word_of_part
from drone_sim.mechanics.object_names import plain
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import SensorParameters
from drone_sim.vehicles.parameters import VehicleParameters


class Part(NamedTuple):
    """A camera or sensor: the section (`cameras` or `sensors`), its key there, and its parameters."""

    among: str
    key: str
    parameters: CameraParameters | SensorParameters

    @property
    def word(self) -> str:
        """Its type, as in properties()."""
        return word_of_part(type(self.parameters))

    @property
    def values(self) -> dict[str, Any]:
        """All values; nested keys have dots, such as `noise.read`."""
        content = self.parameters.model_dump(mode="json")
        mount = content.pop("mount")
        return {**dict(flattened(content)), "mount": mount}


def parts_of(vehicle: VehicleParameters) -> dict[str, Part]:
    """Return the cameras and sensors by the names of their objects, without the vehicle's suffix."""
    sections = {"cameras": vehicle.cameras, "sensors": vehicle.sensors}
    parts = [Part(among, key, item) for among, items in sections.items() for key, item in items.items()]
    return {part.parameters.object or part.key: part for part in parts}


def part_named(vehicle: VehicleParameters, name: str) -> Part | None:
    """Return the camera or sensor with the object `name`, or None."""
    return parts_of(vehicle).get(plain(name))


def with_part(entry: Mapping[str, Any], part: Part, base: Part | None, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a vehicle's entry with other values of a part; nested keys have dots or are in mappings.

    Values that are None or equal to those of `base`, the part with its default values, are left out.
    """
    changed = dict(flattened((entry.get(part.among) or {}).get(part.key) or {}))
    defaults = base.values if base else {}
    for key, value in flattened(values):
        if value is None or (key in defaults and defaults[key] == value):
            changed = {name: other for name, other in changed.items() if name not in _with_dependents(part, key)}
        else:
            changed[key] = value
    section = {**(entry.get(part.among) or {}), part.key: nested(changed.items())}
    section = {name: other for name, other in section.items() if name != part.key or other}
    result = {**entry, part.among: section}
    return result if section else {key: value for key, value in result.items() if key != part.among}


def _with_dependents(part: Part, key: str) -> list[str]:
    """Return a key and those that depend on it, such as a lens' coefficients on its model."""
    fields = dict(inner_fields(type(part.parameters)))
    prefix, dot, _ = key.rpartition(".")
    is_needed = dot and key in fields and fields[key].is_required()
    return [name for name in fields if name.startswith(f"{prefix}.")] if is_needed else [key]
