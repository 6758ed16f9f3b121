"""What a flight was, step by step: kept for the plot, written to a CSV file as it goes, and read back from one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import IO, NamedTuple, TextIO

import numpy as np

from drone_sim.mechanics.frames import Matrix, from_quaternion
from drone_sim.message_text import shown
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

MAX_ROWS = 500_000  # of a table that is read: as many as are drawn
LARGEST = 1e9  # m, m/s, ...: nothing is there, and no axis goes so far
_LONGEST = 10_000  # characters of a line
_Row = tuple[float, ...]


class OutputError(OSError):
    """A table or a video of a flight cannot be continued; what was written of it is not kept."""


class TableRefused(ValueError):
    """A table cannot be read; one line that names the file, the line (from 1) and what is wrong."""


class Recording:
    """A row per step: the state after it, and the command and the propellers that led there.

    The row of t = 0 is the state before any step. Position, quaternion and velocities are those of
    base_link in the world frame, the command is in the track frame, propellers are particle velocities.
    """

    clock = "simulated time"  # what its times are

    def __init__(self, file: IO[str] | None = None, keep: bool = True, vehicle: str = ""):
        """Begin, with the header in the CSV `file` if there is one. Raises OutputError.

        `vehicle` is the one whose flight it is; by default the first.
        Without `keep`, `rows` holds the last one alone: a long flight must not fill the memory.
        """
        self.rows: list[_Row] = []
        self._file = file
        self._keep = keep
        self._vehicle = vehicle
        self._write(COLUMNS)

    def add(self, simulation: Simulation) -> None:
        """Add a row: now. Raises OutputError where the disk is full."""
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
        """Write a row to the file alone. Raises OutputError where the disk is full."""
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
                raise OutputError(error.errno, error.strerror) from None


def _shortest(value: float) -> str:
    """Return the shortest text that a float can be read back from to the last bit."""
    return repr(float(value)).removesuffix(".0")


class SensorSeries(NamedTuple):
    """What one sensor measured of one thing, beside the recording."""

    title: str  # its topic
    unit: str  # with the quantity, such as "range [m]"
    times: np.ndarray  # (n,), s of the flight
    values: np.ndarray  # (n, k), in that unit; not finite where there was nothing to measure
    labels: tuple[str, ...] = ()  # of the k columns, if there is more than one


# ---- a table that is there


def read_table(path: str | Path) -> Recording:
    """Return the flight in a table. Raises OSError and TableRefused."""
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
    header = file.readline(_LONGEST)
    if not header:
        raise TableRefused("is empty")
    if header.rstrip("\r\n").split(",") != list(COLUMNS):
        there = shown(header.strip()[:60])
        raise TableRefused(f"line 1 is {there}: a table of `fly --csv` begins with {COLUMNS[0]},{COLUMNS[1]},...")
    rows: list[_Row] = []
    while line := file.readline(_LONGEST):
        number = len(rows) + 2
        if len(rows) == MAX_ROWS:
            raise TableRefused(f"has more than {MAX_ROWS} rows")
        rows.append(_row(line, number))
        if number > 2 and rows[-1][0] <= rows[-2][0]:
            raise TableRefused(f"line {number}: the time {rows[-1][0]:g} s is not after {rows[-2][0]:g} s")
    if not rows:
        raise TableRefused("has a header but no rows")
    return rows


def _row(line: str, number: int) -> _Row:
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
    return row
