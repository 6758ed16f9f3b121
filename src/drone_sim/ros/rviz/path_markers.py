"""Where the vehicles have flown, in rviz: `view/path`."""

from __future__ import annotations

import math

from visualization_msgs.msg import Marker

from drone_sim.mechanics.frames import Vector
from drone_sim.ros.rviz.marker_topic import MarkerTopic, namespace, new_marker
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle

_PERIOD = 0.1  # s of real time
_SPACING = 0.05  # m between two points
_LENGTH = 1500  # points; the oldest go
_WIDTH = 0.012  # m
_ORANGE = (1.0, 0.42, 0.0, 1.0)
_Seen = tuple[list[int], Vector]


class PathMarkers:
    """Shows the flights since the last start, load or stop as lines, drawn while somebody listens."""

    def __init__(self, simulation: Simulation):
        """Advertise."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/path", _PERIOD)
        self._run = -1
        self._paths: dict[str, _Path] = {}
        self._shown: list[_Seen] = []

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
            self._topic.show([Marker(action=Marker.DELETEALL), *map(_line, lines)])


class _Path:
    """Where one vehicle has flown. Where it was put somewhere else, a line ends and another begins."""

    def __init__(self) -> None:
        self._lines: list[list[Vector]] = []
        self._jumps: int | None = None  # None where nobody has looked for a while
        self._place: Vector = (0.0, 0.0, 0.0)

    @property
    def seen(self) -> _Seen:
        """What changes when it looks different."""
        return [len(line) for line in self._lines], self._place

    def lines(self) -> list[list[Vector]]:
        """Return its lines, the last of them to where the vehicle is now."""
        return [*self._lines[:-1], [*self._lines[-1], self._place]]

    def interrupt(self) -> None:
        """Begin another line the next time."""
        self._jumps = None

    def follow(self, vehicle: Vehicle) -> None:
        """Keep where it is, where that is some way from the last point."""
        self._place = vehicle.state.position
        if vehicle.jumps != self._jumps:
            self._lines = [line for line in self._lines if len(line) > 1]
            self._lines.append([self._place])
        elif math.dist(self._place, self._lines[-1][-1]) > _SPACING:
            self._lines[-1].append(self._place)
            self._shorten()
        self._jumps = vehicle.jumps

    def _shorten(self) -> None:
        if sum(map(len, self._lines)) > _LENGTH:
            del self._lines[0][0]
            if not self._lines[0]:
                del self._lines[0]


def _line(points: list[Vector]) -> Marker:
    return new_marker(Marker.LINE_STRIP, _ORANGE, (_WIDTH, 0, 0), points)
