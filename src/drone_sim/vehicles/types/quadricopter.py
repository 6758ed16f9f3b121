"""V-REP's quadricopter."""

from __future__ import annotations

from drone_sim.vehicles.types.vehicle_type import VehicleType


class Quadricopter(VehicleType):
    """Propellers 1 to 4, as in V-REP."""

    name = "quadricopter"
    rotors = (("front_left", -1), ("back_left", +1), ("back_right", -1), ("front_right", +1))
