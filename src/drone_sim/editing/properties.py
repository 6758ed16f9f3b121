"""The keys of scene file entries, for the property panels of windows."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

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
        **{word: _keys(model) for word, model in models.items()},
        **{word_of_part(model): _part_keys(model) for model in (CameraParameters, *SENSORS)},
    }


def word_of_part(model: type[Checked]) -> str:
    """Return the type name of a vehicle's camera or sensor."""
    return "vehicle_camera" if model is CameraParameters else f"{word_of(model, 'kind')}_sensor"


def inner_fields(model: type[Checked], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the fields of a vehicle's camera or sensor with their keys; nested keys have dots."""
    for key, field in model.model_fields.items():
        bare, _ = _bare(field.annotation, field.metadata)
        if key in _PART_EXCLUDED or (get_origin(bare) is Literal and len(get_args(bare)) == 1):  # the key `kind`
            continue
        if isinstance(bare, type) and issubclass(bare, Checked):
            yield from inner_fields(bare, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", field


def _keys(model: type[Checked]) -> list[dict[str, Any]]:
    return [_property(key, field) for key, field in model.model_fields.items() if key not in _EXCLUDED]


def _part_keys(model: type[Checked]) -> list[dict[str, Any]]:
    text = {"key": "mount", "kind": "other", "what": "where it sits"}
    return [*(_property(key, field) for key, field in inner_fields(model)), text]


def _property(key: str, field: Any) -> dict[str, Any]:
    bare, metadata = _bare(field.annotation, field.metadata)
    parts = get_args(bare) if get_origin(bare) is tuple else ()
    if parts:
        metadata = [*_bare(parts[0], [])[1], *metadata]
    limits = next((item for item in metadata if isinstance(item, Within)), None)
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    simple = isinstance(default, (bool, int, float, str)) or default is None
    return {
        "key": key,
        "kind": "file" if key in _FILES else "color" if key == "color" else _kind(bare, parts),
        "count": len(parts) or None,
        "whole": bare is int,
        "choices": list(get_args(bare)) if get_origin(bare) is Literal else None,
        "least": (0 if limits.or_zero else limits.low) if limits else None,
        "most": limits.high if limits else None,
        "unit": next((item.word for item in metadata if isinstance(item, Unit)), ""),
        "default": list(default) if isinstance(default, tuple) else default if simple else None,
        "what": field.description or "",
    }


def _kind(bare: Any, parts: tuple[Any, ...]) -> str:
    if get_origin(bare) is Literal:
        return "choice"
    if ... in parts:
        return "list"
    return "numbers" if parts else _KINDS.get(bare, "other")


def _bare(annotation: Any, metadata: list[Any]) -> tuple[Any, list[Any]]:
    """Return a type without annotations and without None, and the annotations."""
    if get_origin(annotation) is Annotated:
        inner, *others = get_args(annotation)
        return _bare(inner, [*metadata, *others])
    if get_origin(annotation) in (Union, UnionType):
        members = [item for item in get_args(annotation) if item is not type(None)]
        if len(members) == 1:
            return _bare(members[0], metadata)
    return annotation, metadata
