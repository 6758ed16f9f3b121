"""Recording of a flight step by step, in memory for the plot and in a CSV file, and reading of such a file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import IO, TYPE_CHECKING, NamedTuple, TextIO

import numpy as np

from drone_sim.mechanics.frames import Matrix, from_quaternion
from drone_sim.message_text import shown

if TYPE_CHECKING:  # slow import, which programs that only read recordings do without
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

MAX_ROWS = 500_000  # of a table that is read; as many as can be plotted
LARGEST = 1e9  # m, m/s, ...: larger values are invalid
_MAX_LINE = 10_000  # characters of a line
_Row = tuple[float, ...]


class OutputError(OSError):
    """A table or a video of a flight cannot be written; the incomplete file is discarded."""


class TableRefused(ValueError):
    """A table cannot be read; one line with the file, the line number (from 1) and the problem."""


class Recording:
    """A row per step: the state after the step, and the command and propeller velocities during it.

    The row of t = 0 is the state before any step. Position, quaternion and velocities are those of
    base_link in the world frame, the command is in the track frame, propellers are particle velocities.
    """

    clock = "simulated time"  # the kind of its times

    def __init__(self, file: IO[str] | None = None, keep: bool = True, vehicle: str = ""):
        """Write the header to the CSV `file`, if given. Raises OutputError.

        `vehicle` is the recorded one, by default the first. Without `keep`, `rows` has only the last row, so that a
        long flight does not fill the memory.
        """
        self.rows: list[_Row] = []
        self._file = file
        self._keep = keep
        self._vehicle = vehicle
        self._write(COLUMNS)

    def add(self, simulation: Simulation) -> None:
        """Add a row with the current state. Raises OutputError if the disk is full."""
        drone = simulation.vehicles.get(self._vehicle, simulation.drone)
        position, orientation, linear, angular = drone.body.state
        command = (*drone.commands.now.linear, drone.commands.now.angular.z)
        velocities = drone.propulsion.particle_velocities[:4]
        row = (simulation.time, *position, *orientation, *linear, *angular, *command, *velocities)
        if not self._keep:
            self.rows.clear()
        self.rows.append(row)
        self.write_row(row)

    def write_row(self, row: Iterable[float]) -> None:
        """Write a row to the file only. Raises OutputError if the disk is full."""
        # The shortest texts from which the same numbers are read back exactly.
        self._write(repr(float(value)).removesuffix(".0") for value in row)

    def matrix(self, index: int) -> Matrix:
        """Return a row's transform from base_link to the world."""
        row = self.rows[index]
        return from_quaternion(row[1:4], row[4:8])

    def _write(self, fields: Iterable[str]) -> None:
        if self._file is not None:
            try:
                self._file.write(",".join(fields) + "\n")  # a single call, so that Ctrl-C leaves no incomplete row
            except OSError as error:
                raise OutputError(error.errno, error.strerror) from None


class SensorSeries(NamedTuple):
    """A sensor's measurements of a quantity, drawn beside the recording."""

    title: str  # its topic
    unit: str  # with the quantity: "range [m]"
    times: np.ndarray  # (n,), s of the flight
    values: np.ndarray  # (n, k), in that unit; not finite where nothing was measured
    labels: tuple[str, ...] = ()  # of the k columns, if there is more than one


# ---- reading a table


def read_table(path: str | Path) -> Recording:
    """Return the flight in a CSV file. Raises OSError and TableRefused."""
    with open(path, encoding="utf-8") as file:
        try:
            rows = _rows(file)
        except UnicodeDecodeError:
            raise TableRefused(f"{path}: is not a text file") from None
        except TableRefused as refused:
            raise TableRefused(f"{path}: {refused}") from None
    recording = Recording()
    recording.rows = rows
    return recording


def _rows(file: TextIO) -> list[_Row]:
    header = file.readline(_MAX_LINE)
    if not header:
        raise TableRefused("is empty")
    if header.rstrip("\r\n").split(",") != list(COLUMNS):
        first_line = shown(header.strip()[:60])
        raise TableRefused(f"line 1 is {first_line}: a table of `fly --csv` begins with {COLUMNS[0]},{COLUMNS[1]},...")
    rows: list[_Row] = []
    while line := file.readline(_MAX_LINE):
        number = len(rows) + 2
        if len(rows) == MAX_ROWS:
            raise TableRefused(f"has more than {MAX_ROWS} rows")
        fields = line.rstrip("\r\n").split(",")
        if len(fields) != len(COLUMNS) or not line.endswith("\n"):
            raise TableRefused(
                f"line {number}: has {len(fields)} of {len(COLUMNS)} fields: it is cut off, or from another table"
            )
        try:
            row = tuple(map(float, fields))
        except ValueError as error:
            raise TableRefused(f"line {number}: {error!s:.80}") from None
        if not all(abs(value) < LARGEST for value in row):
            raise TableRefused(f"line {number}: must hold numbers below {LARGEST:g}")
        if rows and row[0] <= rows[-1][0]:
            raise TableRefused(f"line {number}: the time {row[0]:g} s is not after {rows[-1][0]:g} s")
        rows.append(row)
    if not rows:
        raise TableRefused("has a header but no rows")
    return rows
