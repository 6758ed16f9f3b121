"""What a vehicle does, in words: what its script says of it, unless its body says otherwise.

A script knows what it means to do; whether the drone lies on the ground or hangs on a wall, contacts and tilt tell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from drone_sim.mechanics.frames import Vector
from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.commands import UNKNOWN
from drone_sim.vehicles.vehicle import Vehicle

FLYING, HELD, UPSIDE_DOWN, SCRIPT_FAILED = "flying", "held", "upside down", "script failed"
_CARRIES = 0.7  # upward part of a unit normal: steeper than 45 degrees nothing stands
_SLIDES = 0.05  # m/s
_FLOOR = "Floor"


def tilt(body: Body) -> float:
    """Return the angle (rad) between a body's z axis and the vertical."""
    return math.acos(max(-1.0, min(1.0, body.matrix[10])))


def situation(body: Body) -> str:
    """Return what its body does: flying, held, upside down, on the ground, sliding on it, or touching something."""
    if body.is_held:
        return HELD
    touched = body.contacts()
    if tilt(body) > math.pi / 2:
        return UPSIDE_DOWN
    if not touched:
        return FLYING
    below = [one for one in touched if one.normal[2] > _CARRIES]
    if not below:
        return f"touches {_hardest(touched)}"
    return f"{_motion(body.state.linear_velocity)}on {_hardest(below)}"


def _motion(velocity: Vector) -> str:
    return "slides " if math.hypot(*velocity) > _SLIDES else ""


def _hardest(touched: Sequence[Contact]) -> str:
    """Return the name of what is touched with the greatest force."""
    name = max(touched, key=lambda one: math.hypot(*one.force)).what
    return "the ground" if name in ("", _FLOOR) else name


def doing(vehicle: Vehicle) -> str:
    """Return what a vehicle does, in words.

    This is `script failed`, if a script of the vehicle has failed; else the state that the script publishes; else, or
    if that is `flying`, the state of its body.
    """
    if vehicle.flight_state.script_error is not None:
        return SCRIPT_FAILED
    said = str(vehicle.flight_state)
    return situation(vehicle.body) if said == FLYING or said.startswith(UNKNOWN) else said


def hears_commands(vehicle: Vehicle) -> bool:
    """Tell whether a script of the vehicle is subscribed to cmd_vel."""
    return any(bus.hears("cmd_vel") for bus in vehicle.commands.buses)
