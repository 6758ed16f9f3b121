"""Arrows of forces on the vehicles, on `view/forces`, with the namespaces `thrust`, `wind` and `contacts`.

Forces are scaled by the vehicle's weight: in hover with four propellers, each propeller's arrow has the length HOVER.
The scale of the wind is WIND.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Quaternion, Vector, cross
from drone_sim.ros.core.message_conversion import BASE_LINK, frame
from drone_sim.ros.rviz.marker_topics import FleetMarkers, attach_upright, new_marker
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.vehicle import Vehicle

HOVER = 0.2  # m, an arrow of a quarter of the vehicle's weight
LONGEST = 1.0  # m, of a contact's arrow: a crash has forces of a hundred weights
WIND = 0.07  # m for each m/s
_EARTH = 9.81  # m/s², for the scale if there is no gravity
_DECIMALS = 4  # of an arrow's length in m; the markers of a hovering drone stay equal, and are sent once
_MIN_LENGTH = 1e-3  # m; shorter arrows are not drawn
_WIDTH, _POINT = 0.009, 0.025  # m, of a line and of a contact point
_CROSS = 0.045  # m, half a side of the cross at a lost propeller
_ABOVE, _ASIDE, _TEXT_SIZE = 0.5, 0.16, 0.042  # m; the wind is drawn above the text of `view/state`
_GREEN, _RED = (0.05, 0.55, 0.15, 1.0), (0.85, 0.08, 0.05, 1.0)
_TEAL, _PURPLE = (0.0, 0.45, 0.55, 1.0), (0.75, 0.0, 0.6, 1.0)
# Arrows are made of lines. rviz turns lines to the viewer, and does not shade them, as it does its own arrows.
_HEAD = 0.045  # m, length of the head
_MAX_HEAD_SHARE = 0.4  # of the arrow's length
_SPREAD = 0.5  # half width of the head, as a share of its length
_CORNERS: tuple[Vector, ...] = ((1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1))


class _ActingForces(NamedTuple):
    orientation: Quaternion
    lengths: tuple[float, ...]  # m, of the thrusts' arrows
    effectiveness: tuple[float, ...]
    wind: Vector | None  # m/s, world; None without weather
    contacts: tuple[Contact, ...]


class ForceMarkers(FleetMarkers):
    """Arrows for thrust, wind and contact forces. Contacts are those of a step's last sub-step."""

    name = "forces"

    def __init__(self, simulation: Simulation):
        super().__init__(simulation)
        # Step (run and number) and the vehicle's teleports at the first look after it, by vehicle.
        self._teleports: dict[str, tuple[tuple[int, int], int]] = {}

    def _inputs(self, vehicle: Vehicle) -> _ActingForces:
        law = vehicle.propulsion.law
        wind = vehicle.body.wind if self._simulation.context.weather.is_felt else None
        scale = self._scale(vehicle)
        lengths = tuple(round(scale * thrust, _DECIMALS) for thrust in law.thrusts)
        orientation, contacts = vehicle.body.state.orientation, self._step_contacts(vehicle)
        return _ActingForces(orientation, lengths, law.effectiveness, wind, contacts)

    def _scale(self, vehicle: Vehicle) -> float:
        return metres_per_newton(vehicle.body.mass, self._simulation.parameters.gravity)

    def _step_contacts(self, vehicle: Vehicle) -> tuple[Contact, ...]:
        """Return the contacts of the last step; none if the vehicle was set to another pose after it."""
        now = self._simulation.run, self._simulation.steps
        step, teleports = self._teleports.get(vehicle.name, (None, 0))
        if step != now:
            teleports = vehicle.body.teleports
            self._teleports[vehicle.name] = now, teleports
        if not self._simulation.steps or teleports != vehicle.body.teleports:
            return ()
        return tuple(vehicle.body.contacts())

    def _markers(self, vehicle: Vehicle, inputs: _ActingForces) -> Sequence[Marker | None]:
        contacts = _contacts(inputs.contacts, self._scale(vehicle))
        return [_thrusts(vehicle, inputs), *_wind(vehicle, inputs.wind), *contacts]


def metres_per_newton(mass: float, gravity: float) -> float:
    """Return the scale of force arrows for a vehicle's mass (kg) and the gravity (m/s²)."""
    return HOVER / (mass * (abs(gravity) or _EARTH) / 4)


def _thrusts(vehicle: Vehicle, forces: _ActingForces) -> Marker | None:
    """Return the arrows of all propellers: red for a weakened one, a red cross for a lost one."""
    points: list[Vector] = []
    colors: list[ColorRGBA] = []
    for link, length, effectiveness in zip(vehicle.propulsion.rotors.links, forces.lengths, forces.effectiveness):
        start, vector = frames.position(link), _times(length, (link[2], link[6], link[10]))
        lines = arrow(start, vector) if abs(length) > _MIN_LENGTH else []
        corners = [] if effectiveness else _CORNERS  # diagonals of a cube look like a cross from every side
        lines += [_sum(start, _times(reach, corner)) for corner in corners for reach in (-_CROSS, _CROSS)]
        points += lines
        colors += [ColorRGBA(*(_GREEN if effectiveness == 1 else _RED))] * len(lines)
    if not points:
        return None
    marker = new_marker(Marker.LINE_LIST, _GREEN, (_WIDTH, 0, 0), points, ns="thrust")
    marker.colors = colors
    marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
    return marker


def _wind(vehicle: Vehicle, wind: Vector | None) -> list[Marker | None]:
    """Return an arrow of the wind above the vehicle, and a text with its speed."""
    if wind is None:
        return [None, None]
    speed = math.hypot(*wind)
    x, y, z = _times(-_ASIDE / (speed or 1.0), wind)  # the text is upwind of the arrow
    text = new_marker(Marker.TEXT_VIEW_FACING, _TEAL, (0, 0, _TEXT_SIZE), ns="wind")
    text.text = f"wind {speed:.1f} m/s"
    text.pose.position = Point(x, y, z + _ABOVE)
    lines = arrow((0.0, 0.0, _ABOVE), _times(WIND, wind)) if WIND * speed > _MIN_LENGTH else []
    marker = new_marker(Marker.LINE_LIST, _TEAL, (_WIDTH, 0, 0), lines, ns="wind")
    return [attach_upright(vehicle, marker) if lines else None, attach_upright(vehicle, text)]


def _contacts(contacts: Sequence[Contact], scale: float) -> list[Marker | None]:
    """Return contact points, and arrows of the forces on the vehicle, in the world frame."""
    if not contacts:
        return [None, None]
    lines: list[Vector] = []
    for contact in contacts:
        length = scale * math.hypot(*contact.force)
        if length > _MIN_LENGTH:
            lines += arrow(contact.point, _times(scale * min(1.0, LONGEST / length), contact.force))
    positions = [contact.point for contact in contacts]
    points = new_marker(Marker.SPHERE_LIST, _PURPLE, [_POINT] * 3, positions, ns="contacts")
    forces = new_marker(Marker.LINE_LIST, _PURPLE, (_WIDTH, 0, 0), lines, ns="contacts")
    return [points, forces if lines else None]


def arrow(start: Vector, vector: Vector) -> list[Vector]:
    """Return the lines of an arrow from `start` along `vector` (m, not zero), two points for each line.

    The lines are the shaft, and four barbs from the tip.
    """
    length = math.hypot(*vector)
    ahead = vector[0] / length, vector[1] / length, vector[2] / length
    across = cross(ahead, (1.0, 0.0, 0.0) if abs(ahead[0]) < 0.9 else (0.0, 1.0, 0.0))
    side = _times(1 / math.hypot(*across), across)
    tip = _sum(start, vector)
    head = min(_HEAD, _MAX_HEAD_SHARE * length)
    neck = _sum(tip, _times(-head, ahead))
    points = [start, tip]
    for direction in (side, cross(ahead, side)):
        for reach in (_SPREAD * head, -_SPREAD * head):
            points += [tip, _sum(neck, _times(reach, direction))]
    return points


def _times(factor: float, vector: Vector) -> Vector:
    return factor * vector[0], factor * vector[1], factor * vector[2]


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]
