"""The cameras and sensors of vehicles: which object is which of them, and what the scene file says of it."""

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
    """A camera or a sensor: whether it is among `cameras` or `sensors`, its key there, and what it is like."""

    among: str
    key: str
    parameters: CameraParameters | SensorParameters

    @property
    def word(self) -> str:
        """Its type, as windows know it."""
        return word_of_part(type(self.parameters))

    @property
    def values(self) -> dict[str, Any]:
        """All that it is like, inner keys with dots, such as `noise.read`."""
        said = self.parameters.model_dump(mode="json")
        mount = said.pop("mount")
        return {**dict(flattened(said)), "mount": mount}


def parts_of(vehicle: VehicleParameters) -> dict[str, Part]:
    """Return the cameras and sensors by the names of their objects, without the vehicle's suffix."""
    several = {"cameras": vehicle.cameras, "sensors": vehicle.sensors}
    parts = [Part(among, key, one) for among, ones in several.items() for key, one in ones.items()]
    return {one.parameters.object or one.key: one for one in parts}


def part_named(vehicle: VehicleParameters, name: str) -> Part | None:
    """Return the camera or sensor whose object has a name; None where it is another part."""
    return parts_of(vehicle).get(plain(name))


def with_part(said: Mapping[str, Any], part: Part, base: Part | None, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of a vehicle with other values of a part, inner keys with dots or in mappings.

    Values that are None, or the same as in `base`, the part as it is by default, are left out.
    """
    own = dict(flattened((said.get(part.among) or {}).get(part.key) or {}))
    usual = base.values if base else {}
    for key, value in flattened(values):
        if value is None or (key in usual and usual[key] == value):
            own = {one: other for one, other in own.items() if one not in _gone_with(part, key)}
        else:
            own[key] = value
    several = {**(said.get(part.among) or {}), part.key: nested(own.items())}
    several = {one: other for one, other in several.items() if one != part.key or other}
    made = {**said, part.among: several}
    return made if several else {key: value for key, value in made.items() if key != part.among}


def _gone_with(part: Part, key: str) -> list[str]:
    """Return a key, and those that have no meaning without it, such as a lens' coefficients without its model."""
    fields = dict(inner_fields(type(part.parameters)))
    above, dot, _ = key.rpartition(".")
    is_needed = dot and key in fields and fields[key].is_required()
    return [one for one in fields if one.startswith(f"{above}.")] if is_needed else [key]
