"""Which types of vehicles there are. One that is added is added here."""

from __future__ import annotations

from drone_sim.vehicles.types.hexacopter import Hexacopter
from drone_sim.vehicles.types.quadricopter import Quadricopter
from drone_sim.vehicles.types.vehicle_type import VehicleType

TYPES: dict[str, type[VehicleType]] = {one.name: one for one in (Quadricopter, Hexacopter)}


def propeller_places(name: str) -> tuple[str, ...]:
    """Return the places of propellers 1, 2, ... of the type with this name; none if there is no such type."""
    return tuple(place for place, _ in TYPES[name].rotors) if name in TYPES else ()
