"""How high the drone is, what it is told to do, and how it fares, in rviz: `<drone>/view/height`, `command`, `state`."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence, Tuple

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim import frames
from drone_sim.frames import Vector
from drone_sim.pacing import Throttle
from drone_sim.ros.marker_topic import EYES, WORDS, MarkerTopic, shape
from drone_sim.ros.player import Player
from drone_sim.simulation import Simulation
from drone_sim.state import Twist

_ABOVE_FLOOR = 0.004  # m, so that the shadow is not hidden by it
_SHADOW = 0.24, 0.05  # m, its radius, and what a metre of height adds to it
_DARK = 0.55  # opacity of the shadow's middle
_RIM = 24  # corners
_TICK = 0.5  # m
_TICKS = 40
_THIN = 0.006  # m
_INK = (0.10, 0.12, 0.16, 1.0)
_METRES_PER_SPEED = 0.5  # an arrow's length in m for each m/s
_BLUE = (0.05, 0.35, 0.95, 1.0)
_AWAY = 0.3  # m, from the drone's middle: what is about the drone must not hide it
_TEXT_ABOVE, _TEXT_SIZE = 0.42, 0.06  # m


class HeightMarkers:
    """A soft shadow straight below, and a plumb line with a tick for every half metre."""

    def __init__(self, simulation: Simulation):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{simulation.drone.name}/view/height", EYES)
        self._shown: Optional[Vector] = None

    def update(self) -> None:
        """Publish where the drone has moved, if anybody listens."""
        place = self._simulation.drone.state.position
        if place != self._shown and self._topic.due():
            self._shown = place
            self._topic.show([_shadow(place), _plumb_line(place)] if place[2] > 0 else [None, None])


class CommandMarkers:
    """An arrow for the velocity that is commanded, and one around the drone for the turn."""

    def __init__(self, simulation: Simulation):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{simulation.drone.name}/view/command", EYES)
        self._shown: Optional[Tuple[Twist, frames.Matrix]] = None

    def update(self) -> None:
        """Publish command and place where they have changed, if anybody listens."""
        drone = self._simulation.drone
        x, y, z = drone.state.position
        r = drone.track
        state = drone.command, (*r[:3], x, *r[4:7], y, *r[8:11], z)
        if state != self._shown and self._topic.due():
            self._shown = state
            self._topic.show([_arrow(*state), *_turn(*state)])


class StateText:
    """What the simulation does, its time, and the drone's height and speed, above the drone."""

    def __init__(self, simulation: Simulation, player: Player):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        self._player = player
        self._topic = MarkerTopic(f"{simulation.drone.name}/view/state", EYES)
        self._words = Throttle(WORDS)
        self._text = ""
        self._shown: Optional[Tuple[str, Vector]] = None

    def update(self) -> None:
        """Publish text and place where they have changed, if anybody listens."""
        place = self._simulation.drone.state.position
        if not self._topic.due():
            return
        if self._words.passes():
            self._text = self._say()
        if (self._text, place) != self._shown:
            self._shown = self._text, place
            marker = shape(Marker.TEXT_VIEW_FACING, _INK, (0, 0, _TEXT_SIZE))
            marker.text = self._text
            marker.pose.position = Point(place[0], place[1], place[2] + _TEXT_ABOVE)
            self._topic.show([marker])

    def _say(self) -> str:
        simulation, state = self._simulation, self._simulation.drone.state
        if not simulation.running:
            return "stopped"
        doing = "paused" if self._player.paused else "flying"
        speed = math.hypot(*state.linear_velocity)
        return f"{doing}   {simulation.time:.1f} s\nheight {state.position[2]:.2f} m   speed {speed:.2f} m/s"


def _shadow(place: Vector) -> Marker:
    """Return a disc on the floor, dark in the middle, wider and paler with the height."""
    x, y, height = place
    radius = _SHADOW[0] + _SHADOW[1] * height
    angles = [2 * math.pi * number / _RIM for number in range(_RIM)]
    rim = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles]
    points: List[Sequence[float]] = []
    for one, other in zip(rim, [*rim[1:], rim[0]]):
        points += [(0.0, 0.0, 0.0), one, other]
    marker = shape(Marker.TRIANGLE_LIST, (0, 0, 0, 0.99), (radius, radius, 1), points)
    dark = _DARK * (_SHADOW[0] / radius) ** 0.5
    marker.colors = [ColorRGBA(0, 0, 0, dark), ColorRGBA(0, 0, 0, 0), ColorRGBA(0, 0, 0, 0)] * _RIM
    marker.pose.position = Point(x, y, _ABOVE_FLOOR)
    marker.ns = "shadow"
    return marker


def _plumb_line(place: Vector) -> Marker:
    x, y, height = place
    points: List[Vector] = [place, (x, y, 0.0)]
    for number in range(1, min(_TICKS, math.ceil(height / _TICK))):
        half, up = (0.05 if number % 2 else 0.1), number * _TICK
        points += [(x - half, y, up), (x + half, y, up), (x, y - half, up), (x, y + half, up)]
    marker = shape(Marker.LINE_LIST, _INK, (_THIN, 0, 0), points)
    marker.ns = "plumb line"
    return marker


def _arrow(command: Twist, base: frames.Matrix) -> Optional[Marker]:
    speed = math.hypot(*command.linear)
    if not speed:
        return None
    start = frames.transform(base, [_AWAY * part / speed for part in command.linear])
    ahead = frames.rotate(base, [_METRES_PER_SPEED * part for part in command.linear])
    end = [one + other for one, other in zip(start, ahead)]
    return shape(Marker.ARROW, _BLUE, (0.03, 0.07, 0.09), [start, end])


def _turn(command: Twist, base: frames.Matrix) -> Sequence[Optional[Marker]]:
    """Return an arc from the front, as long as the drone turns in a second, and its head."""
    turn = max(-3.0, min(3.0, command.angular[2]))
    if not turn:
        return None, None
    angles = [turn * number / 24 for number in range(25)]
    points = [frames.transform(base, (_AWAY * math.cos(a), _AWAY * math.sin(a), 0.0)) for a in angles]
    along = math.copysign(0.09, turn)
    last, x, y = points[-1], -along * math.sin(turn), along * math.cos(turn)
    tip = [one + other for one, other in zip(last, frames.rotate(base, (x, y, 0.0)))]
    return (
        shape(Marker.LINE_STRIP, _BLUE, (0.025, 0, 0), points),
        shape(Marker.ARROW, _BLUE, (0.025, 0.07, 0.088), [last, tip]),
    )
