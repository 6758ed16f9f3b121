"""The keys of scene file entries, for the property panels of windows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from drone_sim.config.schema import ValueType, field_type, value_type
from drone_sim.config.types import Checked, Unit, Within, word_of
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.object_parameters import SHAPES
from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.sensors import SENSORS
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.parameters import VehicleParameters

_EXCLUDED = ("name", "alias", "model", "parent", "position", "rpy", "yaw", "tilt", "shape", "kind")
_PART_EXCLUDED = ("object", "mount")  # the name, and the pose, which is edited in the text
_FILES = ("file", "texture", "urdf", "script")
_KINDS: dict[Any, str] = {bool: "switch", float: "number", int: "number", str: "text"}


def properties() -> dict[str, list[dict[str, Any]]]:
    """Return the keys of each type of object.

    A type is a value of `shape` or `kind`, floor, vehicle, or the type of a vehicle's camera or sensor. Each key has:
    `key` (nested keys with dots), `kind`, `count` of numbers, `whole` (an integer), `choices`, `least`, `most`, `unit`,
    `default`, and `what`, a description.
    """
    entries: tuple[Any, ...] = (*SHAPES, *KINDS)
    models: dict[str, type[Checked]] = {word_of(entry, "shape", "kind"): entry for entry in entries}
    models.update(floor=FloorParameters, vehicle=VehicleParameters)
    return {
        **{
            word: [_property(key, field) for key, field in model.model_fields.items() if key not in _EXCLUDED]
            for word, model in models.items()
        },
        **{word_of_part(model): _part_keys(model) for model in (CameraParameters, *SENSORS)},
    }


def word_of_part(model: type[Checked]) -> str:
    """Return the type name of a vehicle's camera or sensor."""
    return "vehicle_camera" if model is CameraParameters else f"{word_of(model, 'kind')}_sensor"


def inner_fields(model: type[Checked], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the fields of a vehicle's camera or sensor with their keys; nested keys have dots."""
    for key, field in model.model_fields.items():
        value = field_type(field)
        if key in _PART_EXCLUDED or len(value.words) == 1:  # the key `kind`
            continue
        if isinstance(value.kind, type) and issubclass(value.kind, Checked):
            yield from inner_fields(value.kind, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", field


def _part_keys(model: type[Checked]) -> list[dict[str, Any]]:
    text = {"key": "mount", "kind": "other", "what": "where it sits"}
    return [*(_property(key, field) for key, field in inner_fields(model)), text]


def _property(key: str, field: Any) -> dict[str, Any]:
    value = field_type(field)
    number = value_type(value.elements[0], value.marks) if value.elements else value
    limits, unit = number.mark(Within), number.mark(Unit)
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    simple = isinstance(default, (bool, int, float, str)) or default is None
    return {
        "key": key,
        "kind": "file" if key in _FILES else "color" if key == "color" else _kind(value),
        "count": len(value.elements) or None,
        "whole": value.kind is int,
        "choices": list(value.words) or None,
        "least": (0 if limits.or_zero else limits.low) if limits else None,
        "most": limits.high if limits else None,
        "unit": unit.word if unit else "",
        "default": list(default) if isinstance(default, tuple) else default if simple else None,
        "what": field.description or "",
    }


def _kind(value: ValueType) -> str:
    if value.words:
        return "choice"
    if ... in value.elements:
        return "list"
    return "numbers" if value.elements else _KINDS.get(value.kind, "other")
