"""What may be wrong with a vehicle: weak propellers, sensors that fail, a bad radio link."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated

from pydantic import Field

from drone_sim.config.types import Checked, Fraction, Name, ParameterError, Parts, Within
from drone_sim.sensors.failing import Failure
from drone_sim.vehicles.link import LinkParameters
from drone_sim.wording import near_names, shown

MAX_FAILURES = 80


class FaultParameters(Checked):
    """What is wrong: `commands` and `images` are the radio link's two directions, `sensors` are cameras, too."""

    propellers: Annotated[
        tuple[Fraction, Fraction, Fraction, Fraction],
        Parts(("front_left", "back_left", "back_right", "front_right")),
        Field(description="4 numbers from 0 to 1, the share that each propeller still gives"),
    ]
    commands: LinkParameters
    images: LinkParameters
    sensors: Annotated[dict[Name, Failure], Field(max_length=MAX_FAILURES)]
    seed: Annotated[int, Within(0, 2**63 - 1)]

    def check(self, names: Collection[str]) -> None:
        """Raise ParameterError for a sensor that is not among the names."""
        for name in self.sensors:
            if name not in names:
                said = f"no such sensor or camera; {near_names(name, names)}" if names else "there are no sensors"
                raise ParameterError(f"parameter faults/sensors/{shown(name)}: {said}", ("faults", "sensors", name))
