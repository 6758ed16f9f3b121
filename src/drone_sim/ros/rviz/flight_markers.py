"""Height, command, state and path of vehicles as markers: `view/height`, `/command`, `/state`, `/path`."""

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
from drone_sim.ros.rviz.marker_topics import WORDS, FleetMarkers, band, beside, fan, new_marker
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import situation
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
_PATH_PERIOD = 0.1  # s of real time
_PATH_SPACING = 0.05  # m between two points
_PATH_LENGTH = 1500  # points; the oldest go
_PATH_WIDTH = 0.012  # m
_ORANGE = (1.0, 0.42, 0.0, 1.0)
_Seen = tuple[list[int], Vector]


class HeightMarkers(FleetMarkers):
    """A soft shadow straight below, and a plumb line with a tick for every half metre."""

    name = "height"

    def _look(self, vehicle: Vehicle) -> State:
        return vehicle.body.state

    def _draw(self, vehicle: Vehicle, seen: State) -> Sequence[Marker | None]:
        height = seen.position[2]
        line = beside(vehicle, _plumb_line(round(height, _MILLIMETRES)))
        return [_shadow(seen), line] if height > 0 else [None, None]


class CommandMarkers(FleetMarkers):
    """An arrow for the velocity that is commanded, and one around the vehicle for the turn."""

    name = "command"

    def _look(self, vehicle: Vehicle) -> tuple[Twist, frames.Matrix, State] | None:
        """Return what its arrows are made of, None where it has none."""
        command, moves = vehicle.commands.now, any((*vehicle.commands.now.linear, vehicle.commands.now.angular[2]))
        return (command, vehicle.track.matrix(), vehicle.body.state) if moves else None

    def _draw(self, vehicle: Vehicle, _seen: Any) -> Sequence[Marker | None]:
        command, track = vehicle.commands.now, vehicle.track.matrix()
        markers = [_arrow(command, track), _turn(command, track)]
        return [beside(vehicle, marker) if marker else None for marker in markers]


class StateText(FleetMarkers):
    """The vehicle's flight state, the simulated time, height and speed, above each."""

    name = "state"

    def __init__(self, simulation: Simulation, player: Player):
        """Advertise for the vehicles of `simulation`, which `player` may have paused."""
        super().__init__(simulation)
        self._player = player
        self._words = Throttle(WORDS)
        self._texts: dict[str, str] = {}

    def update(self) -> None:
        """Publish texts and places where they have changed, if anybody listens."""
        if self._topic.watched and self._words.passes():
            self._texts = {name: self._say(vehicle) for name, vehicle in self._simulation.vehicles.items()}
        super().update()

    def _look(self, vehicle: Vehicle) -> tuple[str, State]:
        return self._texts.get(vehicle.name, ""), vehicle.body.state

    def _draw(self, vehicle: Vehicle, seen: tuple[str, State]) -> Sequence[Marker | None]:
        marker = new_marker(Marker.TEXT_VIEW_FACING, _INK, (0, 0, _TEXT_SIZE))
        marker.text, marker.pose.position.z = seen[0], _TEXT_ABOVE
        return [beside(vehicle, marker)]

    def _say(self, vehicle: Vehicle) -> str:
        simulation, state = self._simulation, vehicle.body.state
        doing = situation.doing(vehicle)
        if not simulation.running:
            return f"stopped, {doing}" if doing == situation.SCRIPT_FAILED else "stopped"
        doing = f"paused, {doing}" if self._player.paused else doing
        speed = math.hypot(*state.linear_velocity)
        who = "" if vehicle.parameters.is_alone else f"{vehicle.name}  "
        return f"{who}{doing}  {simulation.time:.1f} s\nheight {state.position[2]:.2f} m  speed {speed:.2f} m/s"


def _shadow(state: State) -> Marker:
    """Return a disc on the floor, dark in the middle, wider and paler with the height."""
    x, y, height = state.position
    radius = round(_SHADOW[0] + _SHADOW[1] * height, _MILLIMETRES)
    angles = [2 * math.pi * number / _RIM for number in range(_RIM)]
    rim = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles]
    points = fan((0.0, 0.0, 0.0), rim)
    marker = new_marker(Marker.TRIANGLE_LIST, (0, 0, 0, 0.99), (radius, radius, 1), points, ns="shadow")
    dark = _DARK * (_SHADOW[0] / radius) ** 0.5
    marker.colors = [ColorRGBA(0, 0, 0, dark), ColorRGBA(0, 0, 0, 0), ColorRGBA(0, 0, 0, 0)] * _RIM
    marker.pose.position = Point(x, y, _ABOVE_FLOOR)
    return marker


def _plumb_line(height: float) -> Marker:
    """Return it as seen from the drone."""
    points: list[Vector] = [(0.0, 0.0, 0.0), (0.0, 0.0, -height)]
    for number in range(1, min(_TICKS, math.ceil(height / _TICK))):
        half, z = (0.05 if number % 2 else 0.1), number * _TICK - height
        points += [(-half, 0.0, z), (half, 0.0, z), (0.0, -half, z), (0.0, half, z)]
    return new_marker(Marker.LINE_LIST, _INK, (_THIN, 0, 0), points, ns="plumb line")


def _arrow(command: Twist, base: frames.Matrix) -> Marker | None:
    """Return the arrow relative to the drone's position; the command is given in the frame `base`, Track_base."""
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
    head = np.array([middle[-1] + _WIDE * aside[-1], middle[-1] - _WIDE * aside[-1], tip])
    points: list[Any] = [*band(list(left), list(right)), *head]
    marker = new_marker(Marker.TRIANGLE_LIST, _BLUE, (1, 1, 1), points)
    marker.colors = [marker.color] * len(points)  # lights it from everywhere
    return marker


class PathMarkers(FleetMarkers):
    """Shows the flights since the last start, load or stop as lines, drawn while somebody listens."""

    name, period = "path", _PATH_PERIOD

    def __init__(self, simulation: Simulation):
        """Advertise for the vehicles of `simulation`."""
        super().__init__(simulation)
        self._run = -1
        self._paths: dict[str, _Path] = {}

    def update(self) -> None:
        """Follow the vehicles, and publish what is new, if anybody listens."""
        vehicles = self._simulation.vehicles
        if self._run != self._simulation.run or not self._topic.watched:
            self._paths = {} if self._run != self._simulation.run else self._paths
            self._run = self._simulation.run
            for path in self._paths.values():
                path.interrupt()
        if not self._topic.watched:
            return
        self._paths = {name: self._paths.get(name) or _Path() for name in vehicles}
        for name, vehicle in vehicles.items():
            self._paths[name].follow(vehicle)
        seen = [path.seen for path in self._paths.values()]
        if seen != self._shown and self._topic.due():
            self._shown = seen
            lines = [line for path in self._paths.values() for line in path.lines() if len(line) > 1]
            drawn = [new_marker(Marker.LINE_STRIP, _ORANGE, (_PATH_WIDTH, 0, 0), line) for line in lines]
            self._topic.show([Marker(action=Marker.DELETEALL), *drawn])


class _Path:
    """Where one vehicle has flown. Where it was put somewhere else, a line ends and another begins."""

    def __init__(self) -> None:
        self._lines: list[list[Vector]] = []
        self._teleports: int | None = None  # None where nobody has looked for a while
        self._place: Vector = (0.0, 0.0, 0.0)

    @property
    def seen(self) -> _Seen:
        """A value that changes whenever the path looks different."""
        return [len(line) for line in self._lines], self._place

    def lines(self) -> list[list[Vector]]:
        """Return its lines, the last of them to where the vehicle is now."""
        return [*self._lines[:-1], [*self._lines[-1], self._place]]

    def interrupt(self) -> None:
        """Begin another line the next time."""
        self._teleports = None

    def follow(self, vehicle: Vehicle) -> None:
        """Add the vehicle's position to the path if it is far enough from the last point."""
        self._place = vehicle.body.state.position
        if vehicle.body.teleports != self._teleports:
            self._lines = [line for line in self._lines if len(line) > 1]
            self._lines.append([self._place])
        elif math.dist(self._place, self._lines[-1][-1]) > _PATH_SPACING:
            self._lines[-1].append(self._place)
            self._shorten()
        self._teleports = vehicle.body.teleports

    def _shorten(self) -> None:
        if sum(map(len, self._lines)) > _PATH_LENGTH:
            del self._lines[0][0]
            if not self._lines[0]:
                del self._lines[0]
