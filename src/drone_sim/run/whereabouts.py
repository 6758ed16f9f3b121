"""Whether every vehicle still is somewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from drone_sim.scene.scene_parameters import FloorParameters
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.vehicle import Vehicle

_NOWHERE = 1e9  # m, m/s and rad/s, summed


class Diverged(RuntimeError):
    """The dynamics has ended in numbers that mean nothing; one line that says when."""


class Whereabouts:
    """Looks after each step where the vehicles are."""

    def __init__(self, floor: FloorParameters, time: Callable[[], float]):
        """Take the floor, and what returns the simulated time (s).

        Where the floor has an edge, the log says once who has gone past it.
        """
        self._time = time
        self._edge = floor.size / 2 if floor.edge else None  # m, of what a vehicle can stand on
        self._past: set[str] = set()

    def check(self, vehicles: Iterable[Vehicle]) -> None:
        """Raise Diverged where one is nowhere any more."""
        for vehicle in vehicles:
            (x, y, z), _, (vx, vy, vz), (wx, wy, wz) = vehicle.body.state
            # Of a NaN no comparison is true. One sum, since this runs in every step.
            if not -_NOWHERE < x + y + z + vx + vy + vz + wx + wy + wz < _NOWHERE:
                where = f"position {x:g} {y:g} {z:g} m, velocity {vx:g} {vy:g} {vz:g} m/s"
                who = "" if vehicle.parameters.is_alone else f"{vehicle.name}: "
                raise Diverged(
                    f"the simulation has diverged at t = {self._time():.2f} s: {who}{where}; `start` begins anew"
                )
            if self._edge is not None and max(abs(x), abs(y)) > self._edge:
                self._tell(vehicle, x, y)

    def _tell(self, vehicle: Vehicle, x: float, y: float) -> None:
        if vehicle.name not in self._past:
            self._past.add(vehicle.name)
            who = "the drone" if vehicle.parameters.is_alone else vehicle.name
            LOG.warning("%s is past the edge of the floor, at %.2f %.2f m: nothing carries it there", who, x, y)
