"""What scripts are told of new values: dynamic_reconfigure's message, as ROS has it on the same topic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

TOPIC, KIND = "parameter_updates", "dynamic_reconfigure/Config"


class Parameter(NamedTuple):
    """dynamic_reconfigure/DoubleParameter and the like."""

    name: str
    value: Any


class Config(NamedTuple):
    """dynamic_reconfigure/Config."""

    bools: list[Parameter]
    ints: list[Parameter]
    strs: list[Parameter]
    doubles: list[Parameter]
    groups: list[Any]


def message_of(values: Mapping[str, Any]) -> Config:
    """Return the message that says what holds, by name."""

    def those(kind: type) -> list[Parameter]:
        return [Parameter(name, value) for name, value in values.items() if type(value) is kind]

    return Config(those(bool), those(int), those(str), those(float), [])
