"""How high the drone is, what it is told to do, how it fares, in rviz: `view/height`, `view/command`, `view/state`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.state import State, Twist
from drone_sim.ros.rviz.marker_topic import EYES, WORDS, MarkerTopic, beside, namespace, new_marker
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.flight_state import UNKNOWN
from drone_sim.vehicles.vehicle import Vehicle

_ABOVE_FLOOR = 0.004  # m, so that the shadow is not hidden by it
_SHADOW = 0.24, 0.05  # m, its radius, and what a metre of height adds to it
_DARK = 0.55  # opacity of the shadow's middle
_MILLIMETRES = 3  # digits: what hovers looks the same from step to step, and is drawn once
_RIM = 24  # corners
_TICK = 0.5  # m
_TICKS = 40
_THIN = 0.006  # m
_INK = (0.10, 0.12, 0.16, 1.0)
_SECONDS = 1.0  # an arrow is as long as the way that is commanded for this time
_BLUE = (0.0, 0.30, 0.95, 1.0)
_AWAY = 0.3  # m, from the drone's middle: what is about the drone must not hide it
_HALF, _WIDE, _HEAD = 0.018, 0.065, 0.12  # m: half the width of an arrow and of its head, and the head's length
_TEXT_ABOVE, _TEXT_SIZE = 0.34, 0.042  # m


class HeightMarkers:
    """A soft shadow straight below, and a plumb line with a tick for every half metre."""

    def __init__(self, simulation: Simulation):
        """Advertise."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/height", EYES)
        self._shown: list[State] = []

    def update(self) -> None:
        """Publish where a vehicle has moved, if anybody listens."""
        vehicles = self._simulation.vehicles.values()
        states = [vehicle.state for vehicle in vehicles]
        if states != self._shown and self._topic.due():
            self._shown = states
            self._topic.show([marker for vehicle in vehicles for marker in _below(vehicle)])


class CommandMarkers:
    """An arrow for the velocity that is commanded, and one around the vehicle for the turn."""

    def __init__(self, simulation: Simulation):
        """Advertise."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/command", EYES)
        self._shown: list[_Told | None] = []

    def update(self) -> None:
        """Publish commands and places where they have changed, if anybody listens."""
        vehicles = self._simulation.vehicles.values()
        seen = [_told(vehicle) for vehicle in vehicles]
        if seen != self._shown and self._topic.due():
            self._shown = seen
            self._topic.show([marker for vehicle in vehicles for marker in _commanded(vehicle)])


_Told = tuple[Twist, frames.Matrix, State]


def _told(vehicle: Vehicle) -> _Told | None:
    """Return what its arrows are made of, None where it has none."""
    command = vehicle.command
    return (command, vehicle.track, vehicle.state) if any((*command.linear, command.angular[2])) else None


class StateText:
    """The vehicle's flight state, the simulated time, height and speed, above each."""

    def __init__(self, simulation: Simulation, player: Player):
        """Advertise."""
        self._simulation = simulation
        self._player = player
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/state", EYES)
        self._words = Throttle(WORDS)
        self._texts: dict[str, str] = {}
        self._shown: list[tuple[str, State]] = []

    def update(self) -> None:
        """Publish texts and places where they have changed, if anybody listens."""
        if not self._topic.due():
            return
        vehicles = self._simulation.vehicles.values()
        if self._words.passes():
            self._texts = {vehicle.name: self._say(vehicle) for vehicle in vehicles}
        seen = [(self._texts.get(vehicle.name, ""), vehicle.state) for vehicle in vehicles]
        if seen != self._shown:
            self._shown = seen
            self._topic.show([_text(vehicle, text) for vehicle, (text, _) in zip(vehicles, seen)])

    def _say(self, vehicle: Vehicle) -> str:
        simulation, state = self._simulation, vehicle.state
        if not simulation.running:
            return "stopped"
        said = str(vehicle.flight_state)
        doing = "flying" if said.startswith(UNKNOWN) else said
        doing = f"paused, {doing}" if self._player.paused else doing
        speed = math.hypot(*state.linear_velocity)
        who = "" if vehicle.parameters.is_alone else f"{vehicle.name}  "
        return f"{who}{doing}  {simulation.time:.1f} s\nheight {state.position[2]:.2f} m  speed {speed:.2f} m/s"


def _text(vehicle: Vehicle, text: str) -> Marker:
    marker = new_marker(Marker.TEXT_VIEW_FACING, _INK, (0, 0, _TEXT_SIZE))
    marker.text, marker.pose.position.z = text, _TEXT_ABOVE
    return beside(vehicle, marker)


def _below(vehicle: Vehicle) -> list[Marker | None]:
    state = vehicle.state
    height = state.position[2]
    return [_shadow(state), beside(vehicle, _plumb_line(round(height, _MILLIMETRES)))] if height > 0 else [None, None]


def _commanded(vehicle: Vehicle) -> list[Marker | None]:
    markers = [_arrow(vehicle.command, vehicle.track), _turn(vehicle.command, vehicle.track)]
    return [beside(vehicle, marker) if marker else None for marker in markers]


def _shadow(state: State) -> Marker:
    """Return a disc on the floor, dark in the middle, wider and paler with the height."""
    x, y, height = state.position
    radius = round(_SHADOW[0] + _SHADOW[1] * height, _MILLIMETRES)
    angles = [2 * math.pi * number / _RIM for number in range(_RIM)]
    rim = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles]
    points: list[Sequence[float]] = []
    for one, other in zip(rim, [*rim[1:], rim[0]]):
        points += [(0.0, 0.0, 0.0), one, other]
    marker = new_marker(Marker.TRIANGLE_LIST, (0, 0, 0, 0.99), (radius, radius, 1), points)
    dark = _DARK * (_SHADOW[0] / radius) ** 0.5
    marker.colors = [ColorRGBA(0, 0, 0, dark), ColorRGBA(0, 0, 0, 0), ColorRGBA(0, 0, 0, 0)] * _RIM
    marker.pose.position = Point(x, y, _ABOVE_FLOOR)
    marker.ns = "shadow"
    return marker


def _plumb_line(height: float) -> Marker:
    """Return it as seen from the drone."""
    points: list[Vector] = [(0.0, 0.0, 0.0), (0.0, 0.0, -height)]
    for number in range(1, min(_TICKS, math.ceil(height / _TICK))):
        half, z = (0.05 if number % 2 else 0.1), number * _TICK - height
        points += [(-half, 0.0, z), (half, 0.0, z), (0.0, -half, z), (0.0, half, z)]
    marker = new_marker(Marker.LINE_LIST, _INK, (_THIN, 0, 0), points)
    marker.ns = "plumb line"
    return marker


def _arrow(command: Twist, base: frames.Matrix) -> Marker | None:
    """Return it as seen from the drone; a command counts in `base`, Track_base."""
    speed = math.hypot(*command.linear)
    if not speed:
        return None
    ahead = np.array(frames.rotate(base, command.linear)) / speed
    aside = np.cross((0.0, 0.0, 1.0), ahead)
    if not aside.any():  # straight up or down
        aside = np.array(frames.rotate(base, (0.0, 1.0, 0.0)))
    aside /= np.linalg.norm(aside)
    reach = _SECONDS * speed
    neck = max(reach - _HEAD, 0.0)
    return _flat(np.array([ahead * _AWAY, ahead * (_AWAY + neck)]), np.array([aside, aside]), ahead * (_AWAY + reach))


def _turn(command: Twist, base: frames.Matrix) -> Marker | None:
    """Return an arc from the front, as far as the turn that is commanded goes."""
    turn = max(-3.0, min(3.0, _SECONDS * command.angular[2]))
    if not turn:
        return None
    neck = turn - math.copysign(min(_HEAD / _AWAY, abs(turn)), turn)
    rays = [(math.cos(a), math.sin(a), 0.0) for a in (*(neck * part / 24 for part in range(25)), turn)]
    *asides, last = np.array([frames.rotate(base, ray) for ray in rays])
    return _flat(_AWAY * np.array(asides), np.array(asides), _AWAY * last)


def _flat(middle: np.ndarray, aside: np.ndarray, tip: np.ndarray) -> Marker:
    """Return a flat arrow along points (n, 3), across unit vectors (n, 3), with its head from the last one to the tip.

    rviz's own arrows are dark when they are seen from behind.
    """
    left, right = middle + _HALF * aside, middle - _HALF * aside
    points: list[Sequence[float]] = []
    for one, other, next_one, next_other in zip(*(side.tolist() for side in (left, right, left[1:], right[1:]))):
        points += [one, other, next_other, one, next_other, next_one]
    head: Any = np.array([middle[-1] + _WIDE * aside[-1], middle[-1] - _WIDE * aside[-1], tip]).tolist()
    points += head
    marker = new_marker(Marker.TRIANGLE_LIST, _BLUE, (1, 1, 1), points)
    marker.colors = [marker.color] * len(points)  # lights it from everywhere
    return marker
