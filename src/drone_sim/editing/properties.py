"""The keys of scene file entries, for the property panels of windows; cameras and sensors of vehicles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, TypedDict

from drone_sim.config.fields import ValueType, field_type, value_type
from drone_sim.config.types import Checked, Unit, Within, flattened, nested, word_of
from drone_sim.mechanics.object_names import plain
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.object_parameters import SHAPES
from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.sensors import SENSORS
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.sensors.sensor import SensorParameters
from drone_sim.vehicles.parameters import VehicleParameters

_EXCLUDED = ("name", "alias", "model", "parent", "position", "rpy", "yaw", "tilt", "shape", "kind")
_PART_EXCLUDED = ("object", "mount")  # the name, and the pose, which is edited in the text
_FILES = ("file", "texture", "urdf", "script")
ValueKind = Literal["number", "numbers", "list", "switch", "text", "file", "choice", "color", "other"]
_KINDS: dict[Any, ValueKind] = {bool: "switch", float: "number", int: "number", str: "text"}


class Description(TypedDict):
    """A key and its meaning."""

    key: str  # nested keys have dots
    kind: ValueKind
    what: str  # a description


class Property(Description, total=False):
    """A key with the values that it may have; the mount of a camera or sensor has only the description."""

    count: int | None  # of numbers
    whole: bool  # an integer
    choices: list[str] | None
    least: float | None
    most: float | None
    unit: str
    default: bool | float | str | list[float] | None


def properties() -> dict[str, list[Property]]:
    """Return the keys of each type of object.

    A type is a value of `shape` or `kind`, floor, vehicle, or the type of a vehicle's camera or sensor.
    """
    entries: tuple[Any, ...] = (*SHAPES, *KINDS)
    models: dict[str, type[Checked]] = {word_of(entry, "shape", "kind"): entry for entry in entries}
    models.update(floor=FloorParameters, vehicle=VehicleParameters)
    mount: Property = {"key": "mount", "kind": "other", "what": "where it sits"}
    return {
        **{
            word: [_property(key, field) for key, field in model.model_fields.items() if key not in _EXCLUDED]
            for word, model in models.items()
        },
        **{
            _word_of_part(model): [*(_property(key, field) for key, field in _inner_fields(model)), mount]
            for model in (CameraParameters, *SENSORS)
        },
    }


def _word_of_part(model: type[Checked]) -> str:
    """Return the type name of a vehicle's camera or sensor."""
    return "vehicle_camera" if model is CameraParameters else f"{word_of(model, 'kind')}_sensor"


def _inner_fields(model: type[Checked], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the fields of a vehicle's camera or sensor with their keys; nested keys have dots."""
    for key, field in model.model_fields.items():
        value = field_type(field)
        if key in _PART_EXCLUDED or len(value.words) == 1:  # the key `kind`
            continue
        if isinstance(value.kind, type) and issubclass(value.kind, Checked):
            yield from _inner_fields(value.kind, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", field


def _property(key: str, field: Any) -> Property:
    value = field_type(field)
    number = value_type(value.elements[0], value.marks) if value.elements else value
    limits, unit = number.mark(Within), number.mark(Unit)
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    is_simple = isinstance(default, (bool, int, float, str))
    return {
        "key": key,
        "kind": "file" if key in _FILES else "color" if key == "color" else _kind(value),
        "count": len(value.elements) or None,
        "whole": value.kind is int,
        "choices": list(value.words) or None,
        "least": (0 if limits.or_zero else limits.low) if limits else None,
        "most": limits.high if limits else None,
        "unit": unit.word if unit else "",
        "default": list(default) if isinstance(default, tuple) else default if is_simple else None,
        "what": field.description or "",
    }


def _kind(value: ValueType) -> ValueKind:
    if value.words:
        return "choice"
    if ... in value.elements:
        return "list"
    return "numbers" if value.elements else _KINDS.get(value.kind, "other")


# ---- cameras and sensors of vehicles


class Part(NamedTuple):
    """A camera or sensor: the section (`cameras` or `sensors`), its key there, and its parameters."""

    among: str
    key: str
    parameters: CameraParameters | SensorParameters

    @property
    def word(self) -> str:
        """Its type, as in properties()."""
        return _word_of_part(type(self.parameters))

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
    fields = dict(_inner_fields(type(part.parameters)))
    prefix, dot, _ = key.rpartition(".")
    is_needed = dot and key in fields and fields[key].is_required()
    return [name for name in fields if name.startswith(f"{prefix}.")] if is_needed else [key]
