"""What a flight was, step by step: kept for the plot, written to a CSV file as it goes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import IO

from drone_sim.mechanics.frames import Matrix, from_quaternion
from drone_sim.run.simulation import Simulation

COLUMNS = (
    "t [s]",
    *(f"{axis} [m]" for axis in "xyz"),
    *(f"q{axis}" for axis in "xyzw"),
    *(f"v{axis} [m/s]" for axis in "xyz"),
    *(f"w{axis} [rad/s]" for axis in "xyz"),
    *(f"command_v{axis} [m/s]" for axis in "xyz"),
    "command_wz [rad/s]",
    *(f"propeller{number} [m/s]" for number in (1, 2, 3, 4)),
)


class TableError(OSError):
    """The table cannot be written on; what there is of it is not kept."""


class Recording:
    """A row per step: the state after it, and the command and the propellers that led there.

    The row of t = 0 is the state before any step. Position, quaternion and velocities are those of
    base_link in the world frame, the command is in the track frame, propellers are particle velocities.
    """

    clock = "simulated time"  # what its times are

    def __init__(self, file: IO[str] | None = None, keep: bool = True, vehicle: str = ""):
        """Take the CSV file, if there is to be one, and write its header. Raises TableError.

        `vehicle` is the one whose flight it is; by default the first.
        Without `keep`, `rows` holds the last one alone: a long flight must not fill the memory.
        """
        self.rows: list[tuple[float, ...]] = []
        self._file = file
        self._keep = keep
        self._vehicle = vehicle
        self._write(COLUMNS)

    def add(self, simulation: Simulation) -> None:
        """Add a row: now. Raises TableError where the disk is full."""
        drone = simulation.vehicles.get(self._vehicle, simulation.drone)
        position, orientation, linear, angular = drone.state
        command = (*drone.command.linear, drone.command.angular.z)
        row = (simulation.time, *position, *orientation, *linear, *angular, *command, *drone.particle_velocities)
        if not self._keep:
            self.rows.clear()
        self.rows.append(row)
        self.write_row(row)

    def write_row(self, row: Iterable[float]) -> None:
        """Write a row to the file alone. Raises TableError where the disk is full."""
        self._write(map(_shortest, row))

    def matrix(self, index: int) -> Matrix:
        """Return the transform world from base_link of a row."""
        row = self.rows[index]
        return from_quaternion(row[1:4], row[4:8])

    def _write(self, fields: Iterable[str]) -> None:
        if self._file is not None:
            try:
                self._file.write(",".join(fields) + "\n")  # at once: Ctrl-C leaves no half row
            except OSError as error:
                raise TableError(error.errno, error.strerror) from None


def _shortest(value: float) -> str:
    """Return the shortest text that a float can be read back from to the last bit."""
    return repr(float(value)).removesuffix(".0")
