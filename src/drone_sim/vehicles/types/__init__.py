"""Which types of vehicles there are. One that is added is added here."""

from __future__ import annotations

from drone_sim.vehicles.types.hexacopter import Hexacopter
from drone_sim.vehicles.types.quadricopter import Quadricopter
from drone_sim.vehicles.types.vehicle_type import VehicleType

TYPES: dict[str, type[VehicleType]] = {one.name: one for one in (Quadricopter, Hexacopter)}
