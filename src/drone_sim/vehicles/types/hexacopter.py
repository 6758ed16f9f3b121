"""A hexacopter with V-REP's propellers."""

from __future__ import annotations

from drone_sim.vehicles.types.vehicle_type import VehicleType


class Hexacopter(VehicleType):
    """Propellers 1 to 6, counter-clockwise from the front left; child_scripts/hexacopter.py flies it."""

    name = "hexacopter"
    rotors = (
        ("front_left", -1),
        ("left", +1),
        ("back_left", -1),
        ("back_right", +1),
        ("right", -1),
        ("front_right", +1),
    )
