"""Weather and faults that come by topic: the keys of the YAML files, with other values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import KeyValue

from drone_sim.config.changing import changed
from drone_sim.config.types import Checked, ParameterError
from drone_sim.files import yaml_files
from drone_sim.vehicles.checks import Refused
from drone_sim.wording import shown

_DEEPEST, _LONGEST = 4, 1000  # keys, characters


def read_changes(message: KeyValue, model: Checked) -> dict[str, Any]:
    """Return what a message asks for, such as {commands: {loss: 0.2}} of commands/loss and 0.2; raises Refused.

    `model` holds values as there may be: others are refused before they reach the simulation.
    """
    parts = message.key.strip("/").split("/")
    if len(parts) > _DEEPEST or len(message.key) + len(message.value) > _LONGEST:
        raise Refused(f"key {shown(message.key)}: too long")
    try:
        value: Any = yaml_files.parse(message.value)
    except yaml_files.YamlError as error:
        raise Refused(f"value {shown(message.value)}: {error}") from None
    for part in reversed(parts):
        value = {part: value} if part else value
    if not isinstance(value, Mapping):
        raise Refused(f"key '': names none of {', '.join(type(model).model_fields)}")
    check_changes(value, model)
    return dict(value)


def check_changes(changes: Mapping[str, Any], model: Checked) -> None:
    """Raise Refused for what the parameters do not allow."""
    try:
        changed(model, changes)
    except ParameterError as error:
        raise Refused(str(error).removeprefix("parameter ")) from None
