"""What pushes the vehicles, in rviz: `view/forces`, with the namespaces `thrust`, `wind` and `contacts`.

Forces are scaled by the vehicle's own weight: when four propellers hold it in hover, each has an arrow of length HOVER.
Wind has a scale of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector, cross
from drone_sim.mechanics.state import State
from drone_sim.ros.core.message_conversion import BASE_LINK, frame
from drone_sim.ros.rviz.marker_topics import FleetMarkers, beside, new_marker
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.sensor import Contact
from drone_sim.vehicles.vehicle import Vehicle

HOVER = 0.2  # m, an arrow of a quarter of the vehicle's weight
LONGEST = 1.0  # m, of a contact's arrow: a crash has forces of a hundred weights
WIND = 0.07  # m for each m/s
_EARTH = 9.81  # m/s², the scale's where there is no gravity
_FINE = 4  # digits of an arrow's length in m: of what hovers it stays the same, and is drawn once
_SHORTEST = 1e-3  # m; what is shorter is not drawn
_WIDTH, _POINT = 0.009, 0.025  # m, of a line and of a contact
_CROSS = 0.045  # m, half a side of a lost propeller's
_ABOVE, _ASIDE, _TEXT_SIZE = 0.5, 0.16, 0.042  # m: the wind is drawn over the words of `view/state`
_GREEN, _RED = (0.05, 0.55, 0.15, 1.0), (0.85, 0.08, 0.05, 1.0)
_TEAL, _PURPLE = (0.0, 0.45, 0.55, 1.0), (0.75, 0.0, 0.6, 1.0)
# An arrow of lines, which rviz turns to who looks and lights from everywhere; not so its own arrows.
_HEAD = 0.045  # m, how far back its barbs reach
_SHARE = 0.4  # of a short arrow
_SPREAD = 0.5  # how far aside they reach, for each metre back
_CORNERS: tuple[Vector, ...] = ((1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1))


class _ActingForces(NamedTuple):
    """What acts on a vehicle."""

    state: State
    thrusts: tuple[float, ...]  # N
    effectiveness: tuple[float, ...]
    wind: Vector | None  # m/s, world; None without weather
    contacts: tuple[Contact, ...]


class ForceMarkers(FleetMarkers):
    """Arrows for what the propellers give, for the wind, and for what the vehicle touches; drawn for who listens.

    Contacts are those of the step's last sub-step: they are read from the world after it, which changes nothing there.
    """

    name = "forces"

    def __init__(self, simulation: Simulation):
        """Advertise for the vehicles of `simulation`."""
        super().__init__(simulation)
        self._touched = _StepContacts(simulation)

    def _look(self, vehicle: Vehicle) -> _ActingForces:
        law = vehicle.propulsion.law
        wind = vehicle.body.wind if self._simulation.context.weather.is_felt else None
        return _ActingForces(vehicle.body.state, tuple(law.thrusts), law.effectiveness, wind, self._touched.by(vehicle))

    def _draw(self, vehicle: Vehicle, seen: _ActingForces) -> Sequence[Marker | None]:
        scale = metres_per_newton(vehicle.body.mass, self._simulation.parameters.gravity)
        return [_thrusts(vehicle, seen, scale), *_wind(vehicle, seen.wind), *_contacts(seen.contacts, scale)]


class _StepContacts:
    """What vehicles touched in the last step. One that was put elsewhere since then touches nothing yet."""

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._seen: dict[str, tuple[tuple[int, int], int]] = {}  # run and step, and number of teleports of the vehicle

    def by(self, vehicle: Vehicle) -> tuple[Contact, ...]:
        now = self._simulation.run, self._simulation.steps
        seen, teleports = self._seen.get(vehicle.name, (None, 0))
        if seen != now:
            teleports = vehicle.body.teleports
            self._seen[vehicle.name] = now, teleports
        if not self._simulation.steps or teleports != vehicle.body.teleports:
            return ()
        return tuple(vehicle.body.contacts())


def metres_per_newton(mass: float, gravity: float) -> float:
    """Return the scale of forces on a vehicle of so many kg, under a gravity in m/s²."""
    return HOVER / (mass * (abs(gravity) or _EARTH) / 4)


def _thrusts(vehicle: Vehicle, felt: _ActingForces, scale: float) -> Marker | None:
    """Return the arrows of all propellers; red where one is weak, a cross where it is lost."""
    points: list[Vector] = []
    colors: list[ColorRGBA] = []
    for link, thrust, share in zip(vehicle.propulsion.rotors.links, felt.thrusts, felt.effectiveness):
        place, way = frames.position(link), _times(round(scale * thrust, _FINE), (link[2], link[6], link[10]))
        lines = arrow(place, way) if abs(scale * thrust) > _SHORTEST else []
        corners = [] if share else _CORNERS  # whose diagonals are a cross from wherever it is seen
        lines += [_sum(place, _times(reach, corner)) for corner in corners for reach in (-_CROSS, _CROSS)]
        points += lines
        colors += [ColorRGBA(*(_GREEN if share == 1 else _RED))] * len(lines)
    if not points:
        return None
    marker = new_marker(Marker.LINE_LIST, _GREEN, (_WIDTH, 0, 0), points, ns="thrust")
    marker.colors = colors
    marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
    return marker


def _wind(vehicle: Vehicle, wind: Vector | None) -> list[Marker | None]:
    """Return an arrow above the vehicle, and its speed in words."""
    if wind is None:
        return [None, None]
    speed = math.hypot(*wind)
    x, y, z = _times(-_ASIDE / (speed or 1.0), wind)  # the words are where it comes from
    text = new_marker(Marker.TEXT_VIEW_FACING, _TEAL, (0, 0, _TEXT_SIZE), ns="wind")
    text.text = f"wind {speed:.1f} m/s"
    text.pose.position = Point(x, y, z + _ABOVE)
    lines = arrow((0.0, 0.0, _ABOVE), _times(WIND, wind)) if WIND * speed > _SHORTEST else []
    shaft = new_marker(Marker.LINE_LIST, _TEAL, (_WIDTH, 0, 0), lines, ns="wind")
    return [beside(vehicle, shaft) if lines else None, beside(vehicle, text)]


def _contacts(contacts: Sequence[Contact], scale: float) -> list[Marker | None]:
    """Return the points, and arrows for the forces on the vehicle, in the world."""
    if not contacts:
        return [None, None]
    lines: list[Vector] = []
    for one in contacts:
        length = scale * math.hypot(*one.force)
        if length > _SHORTEST:
            lines += arrow(one.point, _times(scale * min(1.0, LONGEST / length), one.force))
    points = new_marker(Marker.SPHERE_LIST, _PURPLE, [_POINT] * 3, [one.point for one in contacts], ns="contacts")
    forces = new_marker(Marker.LINE_LIST, _PURPLE, (_WIDTH, 0, 0), lines, ns="contacts")
    return [points, forces if lines else None]


def arrow(start: Vector, way: Vector) -> list[Vector]:
    """Return the lines of an arrow from `start` along `way`, which is not 0 (m), point by point.

    They are its shaft and four barbs, each of which begins at the tip.
    """
    length = math.hypot(*way)
    x, y, z = ahead = way[0] / length, way[1] / length, way[2] / length
    across = cross(ahead, (1.0, 0.0, 0.0) if abs(x) < 0.9 else (0.0, 1.0, 0.0))
    aside = _times(1 / math.hypot(*across), across)
    tip = _sum(start, way)
    back = min(_HEAD, _SHARE * length)
    neck = _sum(tip, (-back * x, -back * y, -back * z))
    points = [start, tip]
    for direction in (aside, cross(ahead, aside)):
        for reach in (_SPREAD * back, -_SPREAD * back):
            points += [tip, _sum(neck, _times(reach, direction))]
    return points


def _times(factor: float, vector: Vector) -> Vector:
    return factor * vector[0], factor * vector[1], factor * vector[2]


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]
