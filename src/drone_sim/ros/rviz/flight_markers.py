"""Height, command, state and path of vehicles as markers: `view/height`, `/command`, `/state`, `/path`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.state import Twist
from drone_sim.ros.core.message_conversion import BASE_LINK, frame
from drone_sim.ros.rviz.marker_topics import TEXT_PERIOD, FleetMarkers, attach_upright, band, fan, new_marker
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles import situation
from drone_sim.vehicles.vehicle import Vehicle

_ABOVE_FLOOR = 0.004  # m, so that the floor does not hide the shadow
_SHADOW = 0.24, 0.05  # m, radius on the floor, and increase for each metre of height
_SHADOW_OPACITY = 0.55  # in the middle
_MILLIMETRES = 3  # decimals; the markers of a hovering drone stay equal, and are sent once
_ROTATION_DECIMALS = 3  # of a rotation: finer differences are smaller than a millimetre at the tip of an arrow
_RIM = 24  # corners
_ANGLES = [2 * math.pi * number / _RIM for number in range(_RIM)]
_DISC = fan(Point(), [Point(math.cos(angle), math.sin(angle), 0.0) for angle in _ANGLES])
_TICK = 0.5  # m
_MAX_TICKS = 40
_LINE_WIDTH = 0.006  # m
_INK = (0.10, 0.12, 0.16, 1.0)
_PALE_INK = (0.10, 0.12, 0.16, 0.4)
_SECONDS = 1.0  # an arrow is as long as the distance that is commanded for this time
_BLUE = (0.0, 0.30, 0.95, 1.0)
_DISTANCE = 0.3  # m, of arrows from the drone's center, so that they do not hide it
_HALF_WIDTH, _HALF_HEAD, _HEAD = 0.018, 0.065, 0.12  # m: of an arrow's shaft and head; length of the head
_TEXT_ABOVE, _TEXT_SIZE = 0.34, 0.042  # m
_PATH_PERIOD = 0.1  # s of real time
_PATH_SPACING = 0.05  # m between two points
_MAX_PATH_POINTS = 1500  # then the oldest points are deleted
_PATH_WIDTH = 0.012  # m
_ORANGE = (1.0, 0.42, 0.0, 1.0)
_PathKey = tuple[list[int], Vector]


class HeightMarkers(FleetMarkers):
    """A shadow on the floor below each vehicle, and a plumb line with a tick for every half metre."""

    name = "height"

    def _inputs(self, vehicle: Vehicle) -> tuple[Vector, bool, frames.Quaternion]:
        x, y, height = vehicle.body.state.position
        return (x, y, round(height, _MILLIMETRES)), height > 0, vehicle.body.state.orientation

    def _markers(self, vehicle: Vehicle, inputs: tuple[Vector, bool, frames.Quaternion]) -> Sequence[Marker | None]:
        position, is_above, _ = inputs
        line = attach_upright(vehicle, _plumb_line(position[2]))
        return [_shadow(position), line] if is_above else [None, None]


class CommandMarkers(FleetMarkers):
    """An arrow for the commanded velocity, and an arc around the vehicle for the commanded yaw rate."""

    name = "command"

    def _inputs(self, vehicle: Vehicle) -> tuple[Twist, list[float]]:
        """Return the command, and the rotation of its frame in base_link, which stays equal while the drone turns."""
        turn = frames.relative_turn(vehicle.body.matrix, vehicle.track.matrix())
        return vehicle.commands.now, [round(value, _ROTATION_DECIMALS) for value in turn]

    def _markers(self, vehicle: Vehicle, inputs: tuple[Twist, list[float]]) -> Sequence[Marker | None]:
        command, turn = inputs
        markers = _velocity_arrow(command), _yaw_arc(command)
        for marker in filter(None, markers):
            marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
            marker.pose.orientation = Quaternion(*frames.to_quaternion(turn))
        return markers


class StateText(FleetMarkers):
    """Text above each vehicle: flight state, simulated time, height and speed."""

    name = "state"

    def __init__(self, simulation: Simulation, player: Player):
        """Advertise for the vehicles of `simulation`; `player` knows whether it is paused."""
        super().__init__(simulation)
        self._player = player
        self._text_throttle = Throttle(TEXT_PERIOD)
        self._texts: dict[str, str] = {}

    def update(self) -> None:
        if self._topic.has_subscribers and self._text_throttle.passes():
            self._texts = {name: self._text(vehicle) for name, vehicle in self._simulation.vehicles.items()}
        super().update()

    def _inputs(self, vehicle: Vehicle) -> tuple[str, list[float]]:
        """Return the text, and the way up in base_link."""
        up = [round(value, _ROTATION_DECIMALS) for value in vehicle.body.matrix[8:11]]
        return self._texts.get(vehicle.name, ""), up

    def _markers(self, vehicle: Vehicle, inputs: tuple[str, list[float]]) -> Sequence[Marker | None]:
        marker = new_marker(Marker.TEXT_VIEW_FACING, _INK, (0, 0, _TEXT_SIZE))
        marker.text, marker.pose.position = inputs[0], Point(*(_TEXT_ABOVE * value for value in inputs[1]))
        marker.header.frame_id, marker.frame_locked = frame(vehicle.parameters, BASE_LINK), True
        return [marker]

    def _text(self, vehicle: Vehicle) -> str:
        simulation, state = self._simulation, vehicle.body.state
        activity = situation.doing(vehicle)
        if not simulation.running:
            return f"stopped, {activity}" if activity == situation.SCRIPT_FAILED else "stopped"
        activity = f"paused, {activity}" if self._player.paused else activity
        speed = math.hypot(*state.linear_velocity)
        name = "" if vehicle.parameters.is_alone else f"{vehicle.name}  "
        return f"{name}{activity}  {simulation.time:.1f} s\nheight {state.position[2]:.2f} m  speed {speed:.2f} m/s"


def _shadow(position: Vector) -> Marker:
    """Return a disc on the floor; it is larger and paler for a greater height."""
    x, y, height = position
    radius = round(_SHADOW[0] + _SHADOW[1] * height, _MILLIMETRES)
    marker = new_marker(Marker.TRIANGLE_LIST, (0, 0, 0, 0.99), (radius, radius, 1), ns="shadow")
    marker.points = _DISC
    opacity = _SHADOW_OPACITY * (_SHADOW[0] / radius) ** 0.5
    marker.colors = [ColorRGBA(0, 0, 0, opacity), ColorRGBA(0, 0, 0, 0), ColorRGBA(0, 0, 0, 0)] * _RIM
    marker.pose.position = Point(x, y, _ABOVE_FLOOR)
    return marker


def _plumb_line(height: float) -> Marker:
    """Return the line and its ticks relative to the drone's position."""
    points: list[Vector] = [(0.0, 0.0, 0.0), (0.0, 0.0, -height)]
    for number in range(1, min(_MAX_TICKS, math.ceil(height / _TICK))):
        half, z = (0.05 if number % 2 else 0.1), number * _TICK - height
        points += [(-half, 0.0, z), (half, 0.0, z), (0.0, -half, z), (0.0, half, z)]
    return new_marker(Marker.LINE_LIST, _PALE_INK, (_LINE_WIDTH, 0, 0), points, ns="plumb line")


def _velocity_arrow(command: Twist) -> Marker | None:
    """Return the arrow relative to the drone's position, in the command's frame, Track_base."""
    speed = math.hypot(*command.linear)
    if not speed:
        return None
    ahead = np.array(command.linear) / speed
    side = np.cross((0.0, 0.0, 1.0), ahead)
    if not side.any():  # straight up or down
        side = np.array((0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    length = _SECONDS * speed
    shaft = max(length - _HEAD, 0.0)
    center_line = np.array([ahead * _DISTANCE, ahead * (_DISTANCE + shaft)])
    return _flat_arrow(center_line, np.array([side, side]), ahead * (_DISTANCE + length))


def _yaw_arc(command: Twist) -> Marker | None:
    """Return an arc from the front, as long as the angle that is commanded for _SECONDS, at most 3 rad."""
    angle = max(-3.0, min(3.0, _SECONDS * command.angular[2]))
    if not angle:
        return None
    shaft = angle - math.copysign(min(_HEAD / _DISTANCE, abs(angle)), angle)
    *sides, tip = np.array([
        (math.cos(a), math.sin(a), 0.0) for a in (*(shaft * part / 24 for part in range(25)), angle)
    ])  # fmt: skip
    return _flat_arrow(_DISTANCE * np.array(sides), np.array(sides), _DISTANCE * tip)


def _flat_arrow(center_line: np.ndarray, sides: np.ndarray, tip: np.ndarray) -> Marker:
    """Return a flat arrow: `center_line` (n, 3) of its shaft, unit vectors `sides` (n, 3) across it, and the tip.

    rviz's own arrows are dark when they are seen from behind.
    """
    left, right = center_line + _HALF_WIDTH * sides, center_line - _HALF_WIDTH * sides
    head = np.array([center_line[-1] + _HALF_HEAD * sides[-1], center_line[-1] - _HALF_HEAD * sides[-1], tip])
    points: list[Any] = [*band(list(left), list(right)), *head]
    marker = new_marker(Marker.TRIANGLE_LIST, _BLUE, (1, 1, 1), points)
    marker.colors = [marker.color] * len(points)  # rviz does not shade triangles with colors of their own
    return marker


class PathMarkers(FleetMarkers):
    """Lines of the flights since the last start, load or stop, as far as there were subscribers."""

    name, period = "path", _PATH_PERIOD

    def __init__(self, simulation: Simulation):
        super().__init__(simulation)
        self._run = -1
        self._paths: dict[str, _Path] = {}

    def update(self) -> None:
        vehicles = self._simulation.vehicles
        if self._run != self._simulation.run or not self._topic.has_subscribers:
            self._paths = {} if self._run != self._simulation.run else self._paths
            self._run = self._simulation.run
            for path in self._paths.values():
                path.interrupt()
        if not self._topic.has_subscribers:
            return
        self._paths = {name: self._paths.get(name) or _Path() for name in vehicles}
        for name, vehicle in vehicles.items():
            self._paths[name].follow(vehicle)
        keys = [path.key for path in self._paths.values()]
        if keys != self._published and self._topic.is_due():
            self._published = keys
            lines = [line for path in self._paths.values() for line in path.lines() if len(line) > 1]
            markers = [new_marker(Marker.LINE_STRIP, _ORANGE, (_PATH_WIDTH, 0, 0), line) for line in lines]
            self._topic.show([Marker(action=Marker.DELETEALL), *markers])


class _Path:
    """Path of one vehicle. If the vehicle is set to another pose, a new line begins."""

    def __init__(self) -> None:
        self._lines: list[list[Vector]] = []
        self._teleports: int | None = None  # of the vehicle at the last position; None after an interruption
        self._position: Vector = (0.0, 0.0, 0.0)

    @property
    def key(self) -> _PathKey:
        """A value that changes whenever the path changes by a millimetre."""
        x, y, z = (round(value, _MILLIMETRES) for value in self._position)
        return [len(line) for line in self._lines], (x, y, z)

    def lines(self) -> list[list[Vector]]:
        """Return the lines; the last one ends at the vehicle's present position."""
        return [*self._lines[:-1], [*self._lines[-1], self._position]]

    def interrupt(self) -> None:
        """Begin a new line at the next position."""
        self._teleports = None

    def follow(self, vehicle: Vehicle) -> None:
        """Add the vehicle's position if it is far enough from the last point."""
        self._position = vehicle.body.state.position
        if vehicle.body.teleports != self._teleports:
            self._lines = [line for line in self._lines if len(line) > 1]
            self._lines.append([self._position])
        elif math.dist(self._position, self._lines[-1][-1]) > _PATH_SPACING:
            self._lines[-1].append(self._position)
            if sum(map(len, self._lines)) > _MAX_PATH_POINTS:
                del self._lines[0][0]
                if not self._lines[0]:
                    del self._lines[0]
        self._teleports = vehicle.body.teleports
