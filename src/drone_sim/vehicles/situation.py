"""State of a vehicle in words: the state its script publishes, corrected by contacts and tilt.

The script knows what it intends; contacts and tilt show whether the drone lies on the ground or touches a wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.commands import UNKNOWN
from drone_sim.vehicles.vehicle import Vehicle

FLYING, HELD, UPSIDE_DOWN, SCRIPT_FAILED = "flying", "held", "upside down", "script failed"
_MIN_SUPPORT = 0.7  # upward part of a unit normal; on a surface steeper than 45 degrees the drone does not stand
_MIN_SLIDING_SPEED = 0.05  # m/s
_FLOOR = "Floor"


def tilt(body: Body) -> float:
    """Return the angle (rad) between a body's z axis and the vertical."""
    return math.acos(max(-1.0, min(1.0, body.matrix[10])))


def situation(body: Body) -> str:
    """Return the state of a body: flying, held, upside down, on the ground, sliding on it, or touching something."""
    if body.is_held:
        return HELD
    contacts = body.contacts()
    if tilt(body) > math.pi / 2:
        return UPSIDE_DOWN
    if not contacts:
        return FLYING
    below = [contact for contact in contacts if contact.normal[2] > _MIN_SUPPORT]
    if not below:
        return f"touches {_strongest_contact(contacts)}"
    slides = math.hypot(*body.state.linear_velocity) > _MIN_SLIDING_SPEED
    return f"{'slides ' if slides else ''}on {_strongest_contact(below)}"


def _strongest_contact(contacts: Sequence[Contact]) -> str:
    name = max(contacts, key=lambda contact: math.hypot(*contact.force)).what
    return "the ground" if name in ("", _FLOOR) else name


def doing(vehicle: Vehicle) -> str:
    """Return the state of a vehicle in words.

    This is `script failed` if a script of the vehicle has failed; otherwise the state that the script publishes. If
    there is none, or it is `flying`, it is the state of the body.
    """
    if vehicle.flight_state.script_error is not None:
        return SCRIPT_FAILED
    state = str(vehicle.flight_state)
    return situation(vehicle.body) if state == FLYING or state.startswith(UNKNOWN) else state


def hears_commands(vehicle: Vehicle) -> bool:
    """Return whether a script of the vehicle is subscribed to cmd_vel."""
    return any(bus.hears("cmd_vel") for bus in vehicle.commands.buses)
