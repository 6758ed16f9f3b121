"""A timeline's entries that change what the parameters said: the weather, and what is wrong with a vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from drone_sim.config.errors import problems
from drone_sim.config.types import Checked, Location, ParameterError, merged
from drone_sim.run.parameters import Parameters
from drone_sim.vehicles.parameters import EquipmentParameters, VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Change:
    """Keys of the parameters that become others."""

    changes: Mapping[str, Any]

    def checked(self, _parameters: EquipmentParameters) -> Change:
        """Return this: it has been checked."""
        return self

    def apply(self, vehicle: Vehicle) -> None:
        """Change them."""
        raise NotImplementedError


class Weather(Change):
    """Keys of `weather`, for all vehicles."""

    def apply(self, vehicle: Vehicle) -> None:
        """Change the air that it is in."""
        vehicle.change_weather(self.changes)


class Faults(Change):
    """Keys of `faults`, for one vehicle."""

    def apply(self, vehicle: Vehicle) -> None:
        """Change what is wrong with it."""
        vehicle.change_faults(self.changes)


CHANGES: dict[str, type[Change]] = {"weather": Weather, "faults": Faults}


def read_change(
    kind: str, values: Any, parameters: Parameters, vehicle: VehicleParameters
) -> tuple[Any, list[tuple[Location, str]]]:
    """Return the change that an entry's `weather` or `faults` asks for; or None, and what is wrong with it."""
    base: Checked = parameters.weather if kind == "weather" else vehicle.faults
    model = type(base)
    try:
        checked = model.model_validate(merged(base.model_dump(), values))
    except ValidationError as error:
        found = [(one.location, one.text.removeprefix("parameter ")) for one in problems(error, model)]
        return None, [((kind, *location), _said(kind, text)) for location, text in found]
    try:
        if kind == "faults":
            vehicle.model_copy(update={"faults": checked}).check_faults()
    except ParameterError as error:
        return None, [(error.location, str(error).removeprefix("parameter "))]
    return CHANGES[kind](values), []


def _said(kind: str, text: str) -> str:
    return f"{kind}{text}" if text.startswith((" ", ":")) else f"{kind}/{text}"
