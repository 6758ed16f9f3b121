"""What the entries of a scene file can hold, for windows that show it as properties."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from drone_sim.config.types import Checked, Within, word_of
from drone_sim.scene.kinds import KINDS
from drone_sim.scene.object_parameters import SHAPES
from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.parameters import VehicleParameters

_ASIDE = ("name", "alias", "model", "parent", "position", "rpy", "shape", "kind")
_FILES = ("file", "texture", "urdf", "script")
_KINDS: dict[Any, str] = {bool: "switch", float: "number", int: "number", str: "text"}


def properties() -> dict[str, list[dict[str, Any]]]:
    """Return for each type of object (its word under `shape` or `kind`, floor, vehicle, camera) the keys it can have.

    Of each: `key`, `kind`, `count` of numbers, `choices`, `least` and `most`, `default`, and `what` it is in words.
    """
    entries: tuple[Any, ...] = (*SHAPES, *KINDS)
    models: dict[str, type[Checked]] = {word_of(one, "shape", "kind"): one for one in entries}
    models.update(floor=FloorParameters, vehicle=VehicleParameters, camera=CameraParameters)
    return {word: _keys(model) for word, model in models.items()}


def _keys(model: type[Checked]) -> list[dict[str, Any]]:
    return [_property(key, one) for key, one in model.model_fields.items() if key not in _ASIDE]


def _property(key: str, field: Any) -> dict[str, Any]:
    bare, limits = _bare(field.annotation, field.metadata)
    parts = get_args(bare) if get_origin(bare) is tuple else ()
    if parts:
        limits = _bare(parts[0], [])[1] or limits
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    simple = isinstance(default, (bool, int, float, str)) or default is None
    return {
        "key": key,
        "kind": "file" if key in _FILES else "color" if key == "color" else _kind(bare, parts),
        "count": len(parts) or None,
        "choices": list(get_args(bare)) if get_origin(bare) is Literal else None,
        "least": (0 if limits.or_zero else limits.low) if limits else None,
        "most": limits.high if limits else None,
        "default": list(default) if isinstance(default, tuple) else default if simple else None,
        "what": field.description or "",
    }


def _kind(bare: Any, parts: tuple[Any, ...]) -> str:
    if get_origin(bare) is Literal:
        return "choice"
    return "numbers" if parts else _KINDS.get(bare, "other")


def _bare(annotation: Any, metadata: list[Any]) -> tuple[Any, Within | None]:
    """Return a type without what is said beside it and without None, and its limits."""
    if get_origin(annotation) is Annotated:
        inner, *others = get_args(annotation)
        return _bare(inner, [*metadata, *others])
    if get_origin(annotation) in (Union, UnionType):
        some = [one for one in get_args(annotation) if one is not type(None)]
        if len(some) == 1:
            return _bare(some[0], metadata)
    return annotation, next((one for one in metadata if isinstance(one, Within)), None)
