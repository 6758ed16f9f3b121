"""The types of vehicles. Add a new type to TYPES."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from drone_sim.config.types import read_yaml
from drone_sim.files.resources import package_path
from drone_sim.forces.propellers import Propellers


@dataclass(frozen=True)
class VehicleType:
    """A type of vehicle; `name` is the value of the key `type`.

    `rotors` are propellers 1, 2, and so on: the place, which names the URDF links propeller_<place> and its child
    blades_<place>, and the sense (+-1) of the reaction torque. `thrust_model` makes their Propellers. `config` is the
    file in config/ with the parameters of such a vehicle, '' if those of config/drone.yaml are for it.
    """

    name: str
    rotors: tuple[tuple[str, int], ...]
    thrust_model: Callable[..., Propellers] = Propellers
    config: str = ""

    @property
    def places(self) -> tuple[str, ...]:
        """The places of propellers 1, 2, ..."""
        return tuple(place for place, _ in self.rotors)

    @property
    def senses(self) -> list[int]:
        """The senses of the reaction torques of propellers 1, 2, ..."""
        return [sense for _, sense in self.rotors]

    def entry(self) -> dict[str, Any]:
        """Return the keys that a new vehicle's entry needs besides its place."""
        values = read_yaml(package_path() / "config" / self.config) if self.config else {}
        drone = values.pop("drone", {})
        return {**drone, **values}


QUADRICOPTER = VehicleType(  # as in V-REP
    "quadricopter", (("front_left", -1), ("back_left", +1), ("back_right", -1), ("front_right", +1))
)
HEXACOPTER = VehicleType(  # counter-clockwise from the front left; child_scripts/hexacopter.py flies it
    "hexacopter",
    (("front_left", -1), ("left", +1), ("back_left", -1), ("back_right", +1), ("right", -1), ("front_right", +1)),
    config="hexacopter.yaml",
)
TYPES = {kind.name: kind for kind in (QUADRICOPTER, HEXACOPTER)}


def propeller_places(name: str) -> tuple[str, ...]:
    """Return the places of propellers 1, 2, ... of a type; empty for an unknown type."""
    return TYPES[name].places if name in TYPES else ()
