"""Where the drone has flown, in rviz: `<drone>/view/path`."""

from __future__ import annotations

import math

from visualization_msgs.msg import Marker

from drone_sim.mechanics.frames import Vector
from drone_sim.ros.rviz.marker_topic import MarkerTopic, shape
from drone_sim.run.simulation import Simulation

_PERIOD = 0.1  # s of real time
_SPACING = 0.05  # m between two points
_LENGTH = 1500  # points; the oldest go
_WIDTH = 0.012  # m
_ORANGE = (1.0, 0.42, 0.0, 1.0)


class PathMarkers:
    """Shows the flight since the last start, load or stop as lines, drawn while somebody listens.

    Where the drone was put somewhere else, a line ends and another begins.
    """

    def __init__(self, simulation: Simulation):
        """Advertise in the drone's namespace."""
        self._simulation = simulation
        self._topic = MarkerTopic(f"{simulation.drone.name}/view/path", _PERIOD)
        self._run = -1
        self._jumps: int | None = None  # None where nobody has looked for a while
        self._lines: list[list[Vector]] = []
        self._shown: tuple[int, list[int], Vector | None] = (-1, [], None)

    def update(self) -> None:
        """Follow the drone, and publish what is new, if anybody listens."""
        if not self._topic.watched:
            self._jumps = None
            return
        place = self._follow()
        state = self._run, [len(line) for line in self._lines], place
        if state != self._shown and self._topic.due():
            self._shown = state
            lines = [*self._lines[:-1], [*self._lines[-1], place]]
            clear = Marker(action=Marker.DELETEALL)
            self._topic.show([clear, *(_line(points) for points in lines if len(points) > 1)])

    def _follow(self) -> Vector:
        """Return where the drone is; keep it where that is some way from the last point."""
        drone, run = self._simulation.drone, self._simulation.run
        place = drone.state.position
        if run != self._run:
            self._lines.clear()
        if run != self._run or drone.jumps != self._jumps:
            self._lines = [line for line in self._lines if len(line) > 1]
            self._lines.append([place])
        elif math.dist(place, self._lines[-1][-1]) > _SPACING:
            self._lines[-1].append(place)
            self._shorten()
        self._run, self._jumps = run, drone.jumps
        return place

    def _shorten(self) -> None:
        if sum(map(len, self._lines)) > _LENGTH:
            del self._lines[0][0]
            if not self._lines[0]:
                del self._lines[0]


def _line(points: list[Vector]) -> Marker:
    return shape(Marker.LINE_STRIP, _ORANGE, (_WIDTH, 0, 0), points)
