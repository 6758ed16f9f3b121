"""What the entries of a scene file can hold, for windows that show it as properties."""

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

_ASIDE = ("name", "alias", "model", "parent", "position", "rpy", "yaw", "tilt", "shape", "kind")
_PART_ASIDE = ("object", "mount")  # which is its name; where it sits is written in the text
_FILES = ("file", "texture", "urdf", "script")
_KINDS: dict[Any, str] = {bool: "switch", float: "number", int: "number", str: "text"}


def properties() -> dict[str, list[dict[str, Any]]]:
    """Return for each type of object the keys it can have.

    A type is its word under `shape` or `kind`, floor, vehicle, or that of a vehicle's camera or sensor. Of each key:
    `key`, with dots where it is inside another, `kind`, `count` of numbers, `whole`, `choices`, `least` and `most`,
    `unit`, `default`, and `what` it is in words.
    """
    entries: tuple[Any, ...] = (*SHAPES, *KINDS)
    models: dict[str, type[Checked]] = {word_of(one, "shape", "kind"): one for one in entries}
    models.update(floor=FloorParameters, vehicle=VehicleParameters)
    return {
        **{word: _keys(model) for word, model in models.items()},
        **{word_of_part(model): _part_keys(model) for model in (CameraParameters, *SENSORS)},
    }


def word_of_part(model: type[Checked]) -> str:
    """Return the type of a vehicle's camera, or of a kind of sensor."""
    return "vehicle_camera" if model is CameraParameters else f"{word_of(model, 'kind')}_sensor"


def inner_fields(model: type[Checked], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the fields of a vehicle's camera or sensor with their keys, which have dots where one is inside another."""
    for key, field in model.model_fields.items():
        bare, _ = _bare(field.annotation, field.metadata)
        if key in _PART_ASIDE or (get_origin(bare) is Literal and len(get_args(bare)) == 1):  # which says its kind
            continue
        if isinstance(bare, type) and issubclass(bare, Checked):
            yield from inner_fields(bare, f"{above}{key}.")
        else:
            yield f"{above}{key}", field


def _keys(model: type[Checked]) -> list[dict[str, Any]]:
    return [_property(key, one) for key, one in model.model_fields.items() if key not in _ASIDE]


def _part_keys(model: type[Checked]) -> list[dict[str, Any]]:
    text = {"key": "mount", "kind": "other", "what": "where it sits"}
    return [*(_property(key, field) for key, field in inner_fields(model)), text]


def _property(key: str, field: Any) -> dict[str, Any]:
    bare, metadata = _bare(field.annotation, field.metadata)
    parts = get_args(bare) if get_origin(bare) is tuple else ()
    if parts:
        metadata = [*_bare(parts[0], [])[1], *metadata]
    limits = next((one for one in metadata if isinstance(one, Within)), None)
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
        "unit": next((one.word for one in metadata if isinstance(one, Unit)), ""),
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
    """Return a type without what is said beside it and without None, and what is said."""
    if get_origin(annotation) is Annotated:
        inner, *others = get_args(annotation)
        return _bare(inner, [*metadata, *others])
    if get_origin(annotation) in (Union, UnionType):
        some = [one for one in get_args(annotation) if one is not type(None)]
        if len(some) == 1:
            return _bare(some[0], metadata)
    return annotation, metadata
