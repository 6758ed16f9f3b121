"""The types of vehicles. Add a new type to TYPES."""

from __future__ import annotations

from drone_sim.vehicles.types.hexacopter import Hexacopter
from drone_sim.vehicles.types.quadricopter import Quadricopter
from drone_sim.vehicles.types.vehicle_type import VehicleType

TYPES: dict[str, type[VehicleType]] = {kind.name: kind for kind in (Quadricopter, Hexacopter)}


def propeller_places(name: str) -> tuple[str, ...]:
    """Return the places of propellers 1, 2, ... of a type; empty for an unknown type."""
    return tuple(place for place, _ in TYPES[name].rotors) if name in TYPES else ()
